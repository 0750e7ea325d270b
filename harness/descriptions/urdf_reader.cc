#include "harness/descriptions/urdf_reader.h"

#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/model/body_frame.h"
#include "harness/base/files.h"
#include "harness/descriptions/engine_urdf.h"
#include "harness/descriptions/join_names.h"
#include "harness/descriptions/urdf_outline.h"

namespace dexcheck {
namespace {

/// Keeps what urdfdom would print while it lives.
class MessageCollector : public console_bridge::OutputHandler {
 public:
  MessageCollector() { console_bridge::useOutputHandler(this); }
  ~MessageCollector() override { console_bridge::restorePreviousOutputHandler(); }
  MessageCollector(const MessageCollector&) = delete;
  MessageCollector& operator=(const MessageCollector&) = delete;

  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR) errors_.push_back(text);
  }

  /// Whether materials are what was found first.
  [[nodiscard]] bool IsAboutLooks() const { return !errors_.empty() && errors_[0].starts_with("material "); }

  /// What was found first and where: urdfdom reports from the inside out.
  [[nodiscard]] std::string Describe() const {
    if (errors_.empty()) return "cannot be parsed";
    // urdfdom quotes the file, which may have any characters.
    const std::string first = Abbreviate(errors_[0]);
    return errors_.size() == 1 ? first : first + " (" + Abbreviate(errors_[1]) + ")";
  }

 private:
  std::vector<std::string> errors_;
};

/// @param has_bad_looks set when materials had to be left out.
urdf::ModelInterfaceSharedPtr ParseWithUrdfdom(const std::string& text, const std::string& source,
                                               bool* has_bad_looks) {
  const MessageCollector messages;
  urdf::ModelInterfaceSharedPtr model;
  try {
    model = urdf::parseURDF(text);
    // Dynamics need no materials.
    *has_bad_looks = !model && messages.IsAboutLooks();
    if (*has_bad_looks) model = urdf::parseURDF(RemoveMaterials(text, source));
  } catch (const std::exception& error) {
    throw InputError(source + ": " + error.what());
  }
  if (!model) throw InputError(source + ": " + messages.Describe());
  return model;
}

Pose ToPose(const urdf::Pose& pose) {
  Pose X = Pose::Identity();
  const urdf::Rotation& q = pose.rotation;
  X.linear() = Eigen::Quaterniond(q.w, q.x, q.y, q.z).toRotationMatrix();
  X.translation() = Vector3d(pose.position.x, pose.position.y, pose.position.z);
  return X;
}

/// Volume and box of a primitive shape; a mesh has no volume here.
DescribedShape ReadShape(const urdf::Geometry& geometry, const Pose& X_LS) {
  DescribedShape shape;
  Vector3d half = Vector3d::Zero();
  if (geometry.type == urdf::Geometry::SPHERE) {
    const double r = static_cast<const urdf::Sphere&>(geometry).radius;
    half.setConstant(r);
    shape.volume = 4.0 / 3.0 * kPi * r * r * r;
  } else if (geometry.type == urdf::Geometry::BOX) {
    const urdf::Vector3& size = static_cast<const urdf::Box&>(geometry).dim;
    half = 0.5 * Vector3d(size.x, size.y, size.z);
    shape.volume = size.x * size.y * size.z;
  } else if (geometry.type == urdf::Geometry::CYLINDER) {
    const auto& cylinder = static_cast<const urdf::Cylinder&>(geometry);
    half = Vector3d(cylinder.radius, cylinder.radius, 0.5 * cylinder.length);
    shape.volume = kPi * cylinder.radius * cylinder.radius * cylinder.length;
  }
  const Vector3d around =
      geometry.type == urdf::Geometry::SPHERE ? half : Vector3d(X_LS.linear().cwiseAbs() * half);
  shape.low = X_LS.translation() - around;
  shape.high = X_LS.translation() + around;
  return shape;
}

/// What can touch, or else what is seen.
std::vector<DescribedShape> ReadShapes(const urdf::Link& link) {
  std::vector<DescribedShape> shapes;
  for (const auto& collision : link.collision_array) {
    if (collision->geometry) shapes.push_back(ReadShape(*collision->geometry, ToPose(collision->origin)));
  }
  if (!shapes.empty()) return shapes;
  for (const auto& visual : link.visual_array) {
    if (visual->geometry) shapes.push_back(ReadShape(*visual->geometry, ToPose(visual->origin)));
  }
  return shapes;
}

class UrdfReader {
 public:
  UrdfReader(std::string source, UrdfOutline outline, urdf::ModelInterfaceSharedPtr model,
             const UrdfOptions& options)
      : source_(std::move(source)),
        outline_(std::move(outline)),
        model_(std::move(model)),
        options_(options) {}

  RobotDescription Read() {
    robot_.spec.name = model_->getName();
    robot_.spec.source = source_;
    robot_.states_gravity = false;
    PlaceBase();
    ReadTree();
    if (robot_.spec.joints.empty() && robot_.spec.base.type != BaseType::kFloating) {
      Fail(outline_.links[static_cast<size_t>(outline_.root)].line,
           "no joint moves and the root is fixed (--floating lets it float), got " +
               std::to_string(outline_.joints.size()) + " joints");
    }
    FinishBodies();
    ReadCouplings();
    NoteNames();
    NoteInertials();
    if (!options_.keep_impossible) NoteImpossibleBodies(&robot_);
    return std::move(robot_);
  }

 private:
  /// Where a link is: the joint that moves it (-1 the base) and its own frame in that joint's frame i.
  struct Place {
    int joint;
    Pose X_iL;
  };

  [[noreturn]] void Fail(int line, const std::string& problem) const {
    throw InputError(source_ + ":" + std::to_string(line) + ": " + problem);
  }

  [[nodiscard]] const UrdfLink& Link(int index) const { return outline_.links[static_cast<size_t>(index)]; }

  /// Which link is the base, and whether it floats.
  void PlaceBase() {
    base_ = outline_.root;
    const UrdfLink& root = Link(base_);
    bool floats = options_.floating;
    if (root.child_joints.size() == 1) {
      const UrdfJoint& only = outline_.joints[static_cast<size_t>(root.child_joints[0])];
      if (model_->getJoint(only.name)->type == urdf::Joint::FLOATING) {
        base_ = only.child;
        floats = true;
      }
    }
    robot_.spec.base.link = Link(base_).name;
    robot_.states_base = floats || root.name == "world";
    if (floats) LetBaseFloat(&robot_);
  }

  void ReadTree() {
    parts_.emplace_back();
    std::vector<std::pair<int, Place>> open;  // joints to come, and where their parent links are
    const auto visit = [&](int index, const Place& place) {
      const UrdfLink& link = outline_.links[static_cast<size_t>(index)];
      ReadBody(link, place);
      for (auto joint = link.child_joints.rbegin(); joint != link.child_joints.rend(); ++joint) {
        open.emplace_back(*joint, place);
      }
    };
    visit(base_, {-1, Pose::Identity()});
    while (!open.empty()) {
      const auto [index, parent] = open.back();
      open.pop_back();
      const UrdfJoint& element = outline_.joints[static_cast<size_t>(index)];
      visit(element.child, ReadJoint(element, parent));
    }
  }

  /// @param parent where the parent link is. @return where the child link is.
  Place ReadJoint(const UrdfJoint& element, const Place& parent) {
    const urdf::Joint& joint = *model_->getJoint(element.name);
    const std::string& link = outline_.links[static_cast<size_t>(element.child)].name;
    const std::string key = "joint " + Quote(element.name) + ": ";
    const Pose X_iJ = parent.X_iL * ToPose(joint.parent_to_joint_origin_transform);
    if (!X_iJ.matrix().allFinite()) Fail(element.line, key + "origin: must be finite");
    switch (joint.type) {
      case urdf::Joint::FIXED:
        robot_.spec.frames.push_back({link, parent.joint, X_iJ, std::nullopt});
        return {parent.joint, X_iJ};
      case urdf::Joint::REVOLUTE:
      case urdf::Joint::CONTINUOUS:
      case urdf::Joint::PRISMATIC:
        break;
      default:
        Fail(element.line, key + "type: must be fixed, revolute, continuous or prismatic, got " +
                               (joint.type == urdf::Joint::FLOATING
                                    ? "\"floating\", which must be the only joint on the root"
                                    : "\"planar\""));
    }
    return {AddMovingJoint(joint, link, parent.joint, X_iJ, element.line), robot_.joints.back().X_iL};
  }

  /// @return its index.
  int AddMovingJoint(const urdf::Joint& joint, const std::string& link, int parent, const Pose& X_PJ,
                     int line) {
    const std::string key = "joint " + Quote(joint.name) + ": ";
    const Vector3d given(joint.axis.x, joint.axis.y, joint.axis.z);
    const double length = given.stableNorm();
    if (!(length > 0.0)) Fail(line, key + "axis: must not be zero, got " + FormatNumbers(given));
    constexpr double kUnitVectorAllowance = 1e-4;  // of the digits that people write
    if (std::abs(length - 1.0) > kUnitVectorAllowance) {
      robot_.notes.push_back(key + "axis " + FormatNumbers(given) +
                             " is not a unit vector; its direction counts");
    }
    // Frame i has its z axis along the joint's; the link's own frame is turned back.
    const Matrix3d R = MakeRotation(given / length);
    Joint added;
    added.name = joint.name;
    added.link = link;
    added.parent = parent;
    added.type = joint.type == urdf::Joint::PRISMATIC ? JointType::kPrismatic : JointType::kRevolute;
    added.X_PB = X_PJ;
    added.X_PB.linear() = X_PJ.linear() * R;
    DescribedJoint stated;
    stated.states_armature = false;
    stated.X_iL.linear() = R.transpose();
    stated.line = line;
    stated.axis_length = length;
    ReadLimits(joint, line, &added, &stated);
    ReadFriction(joint, line, &added, &stated);
    robot_.spec.joints.push_back(added);
    robot_.joints.push_back(stated);
    parts_.emplace_back();
    return static_cast<int>(robot_.spec.joints.size()) - 1;
  }

  static Matrix3d MakeRotation(const Vector3d& z) {
    return z == Vector3d::UnitZ() ? Matrix3d(Matrix3d::Identity()) : MakeRotationFromZ(z);
  }

  void ReadLimits(const urdf::Joint& joint, int line, Joint* added, DescribedJoint* stated) const {
    added->lower = -kPi;
    added->upper = kPi;
    stated->states_range = joint.limits != nullptr && joint.type != urdf::Joint::CONTINUOUS;
    if (!stated->states_range) return;
    added->lower = joint.limits->lower;
    added->upper = joint.limits->upper;
    if (added->lower <= added->upper) return;
    Fail(line, "joint " + Quote(joint.name) + ": limit: lower must not exceed upper " +
                   FormatNumber(added->upper) + ", got " + FormatNumber(added->lower));
  }

  void ReadFriction(const urdf::Joint& joint, int line, Joint* added, DescribedJoint* stated) const {
    stated->states_damping = stated->states_dry_friction = joint.dynamics != nullptr;
    if (!joint.dynamics) return;
    added->damping = joint.dynamics->damping;
    added->dry_friction = joint.dynamics->friction;
    const auto check = [&](const char* name, double value) {
      if (value >= 0.0) return;
      Fail(line, "joint " + Quote(joint.name) + ": dynamics: " + name + " must not be negative, got " +
                     FormatNumber(value));
    };
    check("damping", added->damping);
    check("friction", added->dry_friction);
  }

  void ReadBody(const UrdfLink& element, const Place& place) {
    const urdf::LinkConstSharedPtr link = model_->getLink(element.name);
    DescribedPart& part = robot_.parts.emplace_back();
    part.name = element.name;
    part.line = element.line;
    part.joint = place.joint;
    part.X_iL = place.X_iL;
    part.shapes = ReadShapes(*link);
    part.states_inertial = link->inertial != nullptr;
    if (!link->inertial) return;
    const urdf::Inertial& inertial = *link->inertial;
    // The inertia is given along the axes of the inertial's own frame, which stands at the centre of mass.
    MassProperties body{inertial.mass, Vector3d::Zero(), Matrix3d::Zero()};
    // clang-format off
    body.inertia << inertial.ixx, inertial.ixy, inertial.ixz,
                    inertial.ixy, inertial.iyy, inertial.iyz,
                    inertial.ixz, inertial.iyz, inertial.izz;
    // clang-format on
    const bool is_usable = body.mass >= 0.0 && std::isfinite(body.mass) && body.inertia.allFinite();
    const std::string problem = FindPhysicalInconsistency(body);
    if (!is_usable && !options_.keep_impossible) FailInertial(element, problem);
    if (!problem.empty()) impossible_.push_back({&element, problem, place.joint});
    part.X_LC = ToPose(inertial.origin);
    body = ExpressIn(body, part.X_LC);
    part.body = body;
    if (!is_usable) return;
    parts_[static_cast<size_t>(place.joint + 1)].push_back(ExpressIn(body, place.X_iL));
  }

  [[noreturn]] void FailInertial(const UrdfLink& link, const std::string& problem) const {
    Fail(link.line, "link " + Quote(link.name) + ": inertial: " + problem);
  }

  /// Published robots have small parts that no body can be; what counts is the body that they are welded to.
  void JudgeImpossibleParts() {
    if (options_.keep_impossible) return;  // the audit names them
    std::vector<std::string> names;
    for (const ImpossiblePart& part : impossible_) {
      const bool moves = part.joint >= 0 || robot_.spec.base.type != BaseType::kFixed;
      if (moves) {
        const MassProperties& whole =
            part.joint < 0 ? robot_.spec.base.body : robot_.spec.joints[static_cast<size_t>(part.joint)].body;
        if (!FindUndefinedDynamics(whole).empty()) FailInertial(*part.link, part.problem);
        if (!FindPhysicalInconsistency(whole).empty()) continue;  // a note on bodies tells
      }
      names.push_back(part.link->name);
    }
    if (names.empty()) return;
    robot_.notes.push_back("inertials that no body can have, counted in what they are welded to: " +
                           JoinNames(names));
  }

  void FinishBodies() {
    // One part stays as it is: its sum would be rounded.
    const auto combine = [&](size_t i) { return parts_[i].size() == 1 ? parts_[i][0] : Combine(parts_[i]); };
    robot_.spec.base.body = combine(0);
    for (size_t i = 0; i < robot_.spec.joints.size(); ++i) robot_.spec.joints[i].body = combine(i + 1);
    JudgeImpossibleParts();
  }

  /// A joint that follows one which follows a third follows the third.
  void ReadCouplings() {
    std::map<std::string, int> index_of;
    for (const Joint& joint : robot_.spec.joints) {
      index_of.emplace(joint.name, static_cast<int>(index_of.size()));
    }
    for (const UrdfJoint& element : outline_.joints) {
      const urdf::JointConstSharedPtr joint = model_->getJoint(element.name);
      const auto own = index_of.find(element.name);
      if (!joint->mimic || own == index_of.end()) continue;
      JointCoupling coupling{-1, 1.0, 0.0};
      std::set<std::string> seen = {element.name};
      for (urdf::JointConstSharedPtr at = joint; at->mimic;) {
        coupling.offset += coupling.multiplier * at->mimic->offset;
        coupling.multiplier *= at->mimic->multiplier;
        const std::string& name = at->mimic->joint_name;
        const auto leader = index_of.find(name);
        const std::string key = "joint " + Quote(element.name) + ": mimic: ";
        if (leader == index_of.end())
          Fail(element.line, key + "must be a joint that moves, got " + Quote(name));
        if (!seen.insert(name).second) Fail(element.line, key + "must not be cyclic, got " + Quote(name));
        coupling.leader = leader->second;
        at = model_->getJoint(name);
      }
      robot_.spec.joints[static_cast<size_t>(own->second)].coupling = coupling;
    }
  }

  void NoteNames() {
    std::vector<std::string> named;
    for (const UrdfJoint& joint : outline_.joints) {
      if (joint.name.starts_with('#'))
        named.push_back(Quote(joint.name) + " moves " + Quote(Link(joint.child).name));
    }
    if (!named.empty())
      robot_.notes.push_back("joints without a name, called by their number in the file: " +
                             JoinNames(named));
  }

  void NoteInertials() {
    std::vector<std::string> without;
    for (const UrdfLink& link : outline_.links) {
      if (!link.has_inertial) without.push_back(link.name);
    }
    if (without.size() == outline_.links.size()) {
      Fail(outline_.links[static_cast<size_t>(outline_.root)].line,
           "no link has an inertial, so that there are no dynamics, got " + std::to_string(without.size()) +
               " links");
    }
    if (!without.empty())
      robot_.notes.push_back("links without inertial, taken as massless: " + JoinNames(without));
    std::vector<std::string> idle;
    std::vector<double> carried(parts_.size(), 0.0);
    for (size_t i = robot_.spec.joints.size(); i-- > 0;) {
      const Joint& joint = robot_.spec.joints[i];
      carried[i + 1] += joint.body.mass;
      carried[static_cast<size_t>(joint.parent + 1)] += carried[i + 1];
      if (carried[i + 1] == 0.0) idle.insert(idle.begin(), joint.name);
    }
    if (!idle.empty()) robot_.notes.push_back("joints that move no mass: " + JoinNames(idle));
  }

  std::string source_;
  UrdfOutline outline_;
  urdf::ModelInterfaceSharedPtr model_;
  UrdfOptions options_;
  int base_ = -1;  // the base's link
  RobotDescription robot_;
  /// A link whose own inertial breaks an inequality.
  struct ImpossiblePart {
    const UrdfLink* link;
    std::string problem;
    int joint;  ///< That moves it; -1 the base.
  };
  std::vector<ImpossiblePart> impossible_;
  std::vector<std::vector<MassProperties>> parts_;  // of the base, then of each joint's link, in frame i
};

/// The file of a mesh; empty when it is in none of the packages.
std::filesystem::path FindMesh(const std::string& name, const std::filesystem::path& folder,
                               const UrdfOptions& options) {
  std::vector<std::filesystem::path> candidates;
  constexpr std::string_view kPackage = "package://";
  constexpr std::string_view kFile = "file://";
  if (name.starts_with(kPackage)) {
    const std::filesystem::path path = name.substr(kPackage.size());
    const std::filesystem::path package = path.begin() == path.end() ? path : *path.begin();
    for (const std::filesystem::path& root : options.packages) {
      candidates.push_back(root / path);
      if (std::filesystem::absolute(root).lexically_normal().filename() == package) {
        candidates.push_back(root / path.lexically_relative(package));
      }
    }
  } else {
    candidates.push_back(folder / (name.starts_with(kFile) ? name.substr(kFile.size()) : name));
  }
  for (const std::filesystem::path& path : candidates) {
    std::error_code ignored;
    if (std::filesystem::is_regular_file(path, ignored)) return path;
  }
  return {};
}

}  // namespace

RobotDescription ParseUrdf(std::string_view text, const std::string& source, const UrdfOptions& options) {
  UrdfOutline outline = ReadUrdfOutline(text, source);
  const std::vector<std::string> meshes = outline.meshes;
  bool has_bad_looks = false;
  urdf::ModelInterfaceSharedPtr model = ParseWithUrdfdom(
      outline.has_nameless_joints ? NameJoints(text, source) : std::string(text), source, &has_bad_looks);
  for (const UrdfLink& link : outline.links) {
    if (!model->getLink(link.name))
      throw InputError(source + ": link " + Quote(link.name) + ": cannot be parsed");
  }
  for (const UrdfJoint& joint : outline.joints) {
    if (!model->getJoint(joint.name))
      throw InputError(source + ": joint " + Quote(joint.name) + ": cannot be parsed");
  }
  RobotDescription robot = UrdfReader(source, std::move(outline), std::move(model), options).Read();
  if (has_bad_looks) {
    robot.notes.emplace_back(
        "materials that other readers of URDFs refuse, such as two of one name (dynamics need none)");
  }
  if (options.packages.empty()) return robot;
  std::vector<std::string> missing;
  for (const std::string& mesh : meshes) {
    if (FindMesh(mesh, std::filesystem::path(source).parent_path(), options).empty()) missing.push_back(mesh);
  }
  if (!missing.empty()) {
    robot.notes.push_back("meshes that are missing (dynamics need none): " + JoinNames(missing));
  }
  return robot;
}

RobotDescription ReadUrdf(const std::filesystem::path& path, const UrdfOptions& options) {
  return ParseUrdf(ReadBytes(path), path.string(), options);
}

}  // namespace dexcheck
