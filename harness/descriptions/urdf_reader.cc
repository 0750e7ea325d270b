#include "harness/descriptions/urdf_reader.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "controller/common/text.h"
#include "controller/model/rigid_body.h"
#include "harness/descriptions/urdf_file.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

using Element = tinyxml2::XMLElement;

/// Numbers of a joint's elements, which must be some whether or not they are used here.
constexpr struct {
  const char* element;
  const char* attribute;
  bool is_required = false;
} kJointNumbers[] = {{"limit", "lower"},
                     {"limit", "upper"},
                     {"limit", "effort", true},
                     {"limit", "velocity", true},
                     {"dynamics", "damping"},
                     {"dynamics", "friction"},
                     {"mimic", "multiplier"},
                     {"mimic", "offset"},
                     {"safety_controller", "soft_lower_limit"},
                     {"safety_controller", "soft_upper_limit"},
                     {"safety_controller", "k_position"},
                     {"safety_controller", "k_velocity", true},
                     {"calibration", "rising"},
                     {"calibration", "falling"}};

/// Whether two materials have one name.
bool HasMaterialTwice(const Element& robot) {
  std::set<std::string> names;
  for (const Element* material : ListChildren(&robot, "material")) {
    if (!names.insert(ReadAttribute(*material, "name")).second) return true;
  }
  return false;
}

class UrdfReader {
 public:
  UrdfReader(const UrdfFile& file, std::string source, const UrdfOptions& options)
      : file_(file), options_(options) {
    robot_.format = RobotFormat::kUrdf;
    robot_.spec.source = std::move(source);
  }

  RobotDescription Read() {
    ReadHead();
    for (const UrdfJoint& joint : file_.joints()) CheckJoint(joint);
    PlaceBase();
    ReadTree();
    if (robot_.spec.joints.empty() && robot_.spec.base.type != BaseType::kFloating) {
      file_.Fail(file_.link(file_.root()).line,
                 "no joint moves and the root is fixed (--floating lets it float), got " +
                     std::to_string(file_.joints().size()) + " joints");
    }
    FuseParts(&robot_);
    JudgeImpossibleParts();
    ReadCouplings();
    NoteNames();
    NoteInertials();
    if (!options_.keep_impossible) NoteImpossibleBodies(&robot_);
    if (HasMaterialTwice(*file_.robot())) {
      robot_.notes.emplace_back(
          "materials that other readers of URDFs refuse, such as two of one name (dynamics need none)");
    }
    return std::move(robot_);
  }

 private:
  /// Place of a link: the joint that moves it (-1 the base) and its own frame in that joint's frame i.
  struct Place {
    int joint;
    Pose X_iL;
    double fixed_angle = 0.0;  ///< Of the fixed joint that the link hangs on, rad.
  };

  static std::string KeyOf(const UrdfJoint& joint) { return "joint " + Quote(joint.name) + ": "; }
  static std::string KeyOf(const UrdfLink& link) { return "link " + Quote(link.name) + ": "; }

  void ReadHead() {
    const int line = file_.robot()->GetLineNum();
    const char* const name = file_.robot()->Attribute("name");
    if (name == nullptr) file_.Fail(line, "robot: must have a name");
    const char* const version = file_.robot()->Attribute("version");
    if (version != nullptr && std::string_view(version) != "1.0")
      file_.Fail(line, "robot: version: must be 1.0, got " + Quote(version));
    robot_.spec.name = name;
    robot_.states_gravity = false;
  }

  void CheckJoint(const UrdfJoint& joint) const {
    const std::string key = KeyOf(joint);
    constexpr std::string_view kTypes[] = {"fixed",     "revolute", "continuous",
                                           "prismatic", "floating", "planar"};
    if (std::ranges::find(kTypes, joint.type) == std::end(kTypes))
      file_.Fail(joint.line,
                 key + "type: must be fixed, revolute, continuous or prismatic, got " + Quote(joint.type));
    for (const auto& [name, attribute, is_required] : kJointNumbers) {
      const Element* const element = joint.element->FirstChildElement(name);
      if (element == nullptr || (!is_required && element->Attribute(attribute) == nullptr)) continue;
      file_.ReadNumber(*element, key, attribute);
    }
    const bool needs_limit = joint.type == "revolute" || joint.type == "prismatic";
    if (needs_limit && joint.element->FirstChildElement("limit") == nullptr)
      file_.Fail(joint.line, key + "limit: missing");
    const Element* const dynamics = joint.element->FirstChildElement("dynamics");
    if (dynamics != nullptr && dynamics->Attribute("damping") == nullptr)
      file_.ReadNumber(*dynamics, key, "friction");
  }

  /// Which link is the base, and whether it floats.
  void PlaceBase() {
    base_ = file_.root();
    const UrdfLink& root = file_.link(base_);
    bool floats = options_.floating;
    if (root.child_joints.size() == 1 && file_.joint(root.child_joints[0]).type == "floating") {
      base_ = file_.joint(root.child_joints[0]).child;
      floats = true;
    }
    robot_.spec.base.link = file_.link(base_).name;
    robot_.states_base = floats || root.name == "world";
    if (floats) LetBaseFloat(&robot_);
  }

  void ReadTree() {
    std::vector<std::pair<int, Place>> open;  // joints to come, and where their parent links are
    const auto visit = [&](int index, const Place& place) {
      const UrdfLink& link = file_.link(index);
      ReadBody(link, place);
      for (auto joint = link.child_joints.rbegin(); joint != link.child_joints.rend(); ++joint) {
        open.emplace_back(*joint, place);
      }
    };
    visit(base_, {-1, Pose::Identity()});
    while (!open.empty()) {
      const auto [index, parent] = open.back();
      open.pop_back();
      const UrdfJoint& joint = file_.joint(index);
      visit(joint.child, ReadJoint(joint, parent));
    }
    for (const UrdfLink& link : file_.links())
      if (link.element->FirstChildElement("inertial") == nullptr) massless_.push_back(link.name);
  }

  /// @param parent where the parent link is. @return where the child link is.
  Place ReadJoint(const UrdfJoint& joint, const Place& parent) {
    const std::string& link = file_.link(joint.child).name;
    const std::string key = KeyOf(joint);
    double largest_angle = 0.0;
    const Pose X_iJ = parent.X_iL * file_.ReadOrigin(*joint.element, key, &largest_angle);
    if (!X_iJ.matrix().allFinite()) file_.Fail(joint.line, key + "origin: must be finite");
    if (joint.type == "fixed") {
      robot_.spec.frames.push_back({link, parent.joint, X_iJ, std::nullopt});
      return {parent.joint, X_iJ, largest_angle};
    }
    if (joint.type == "floating" || joint.type == "planar") {
      file_.Fail(joint.line, key + "type: must be fixed, revolute, continuous or prismatic, got " +
                                 (joint.type == "floating"
                                      ? "\"floating\", which must be the only joint on the root"
                                      : "\"planar\": write two prismatic joints and a continuous one, "
                                        "with links without inertials between"));
    }
    AddMovingJoint(joint, link, parent.joint, X_iJ);
    robot_.joints.back().largest_angle = largest_angle;
    return {static_cast<int>(robot_.spec.joints.size()) - 1, robot_.joints.back().X_iL};
  }

  void AddMovingJoint(const UrdfJoint& joint, const std::string& link, int parent, const Pose& X_PJ) {
    const std::string key = KeyOf(joint);
    const Element* const axis = joint.element->FirstChildElement("axis");
    const Vector3d given =
        axis == nullptr ? Vector3d::UnitX() : file_.ReadVector(*axis, key, "xyz", Vector3d::Zero());
    const double length = given.stableNorm();
    if (!(length > 0.0)) file_.Fail(joint.line, key + "axis: must not be zero, got " + FormatNumbers(given));
    constexpr double kUnitVectorAllowance = 1e-4;  // of the digits that people write
    if (std::abs(length - 1.0) > kUnitVectorAllowance) {
      robot_.notes.push_back(key + "axis " + FormatNumbers(given) +
                             " is not a unit vector; its direction counts");
    }
    // Frame i has its z axis along the joint's; the link's own frame is turned back.
    Matrix3d R = Matrix3d::Identity();
    if (given / length != Vector3d::UnitZ()) R = MakeRotationFromZ(given / length);
    Joint added;
    added.name = joint.name;
    added.link = link;
    added.parent = parent;
    added.type = joint.type == "prismatic" ? JointType::kPrismatic : JointType::kRevolute;
    added.X_PB = X_PJ;
    added.X_PB.linear() = X_PJ.linear() * R;
    DescribedJoint stated;
    stated.states_armature = false;
    stated.is_plain = true;
    stated.X_iL.linear() = R.transpose();
    stated.line = joint.line;
    stated.axis_length = length;
    ReadLimits(joint, &added, &stated);
    ReadFriction(joint, &added, &stated);
    robot_.spec.joints.push_back(added);
    robot_.joints.push_back(stated);
  }

  void ReadLimits(const UrdfJoint& joint, Joint* added, DescribedJoint* stated) const {
    const std::string key = KeyOf(joint);
    const Element* const limit = joint.element->FirstChildElement("limit");
    // Files whose motors are not known state an effort of 0.
    const double most = limit == nullptr ? 0.0 : file_.ReadNumber(*limit, key, "effort", 0.0);
    if (most > 0.0) stated->forces = {-most, most};
    if (limit != nullptr) stated->velocity_limit = file_.ReadNumber(*limit, key, "velocity", 0.0);
    added->lower = -kPi;
    added->upper = kPi;
    stated->states_range = joint.type != "continuous";
    if (!stated->states_range) return;
    added->lower = file_.ReadNumber(*limit, key, "lower", 0.0);
    added->upper = file_.ReadNumber(*limit, key, "upper", 0.0);
    if (added->lower <= added->upper) return;
    file_.Fail(joint.line, key + "limit: lower must not exceed upper " + FormatNumber(added->upper) +
                               ", got " + FormatNumber(added->lower));
  }

  void ReadFriction(const UrdfJoint& joint, Joint* added, DescribedJoint* stated) const {
    const Element* const dynamics = joint.element->FirstChildElement("dynamics");
    stated->states_damping = stated->states_dry_friction = dynamics != nullptr;
    if (dynamics == nullptr) return;
    const std::string key = KeyOf(joint);
    for (const auto& [name, target] :
         {std::pair("damping", &added->damping), std::pair("friction", &added->dry_friction)}) {
      *target = file_.ReadNumber(*dynamics, key, name, 0.0);
      if (*target >= 0.0) continue;
      file_.Fail(joint.line,
                 key + "dynamics: " + name + " must not be negative, got " + FormatNumber(*target));
    }
  }

  void ReadBody(const UrdfLink& link, const Place& place) {
    const Element* const inertial = link.element->FirstChildElement("inertial");
    DescribedPart& part = robot_.parts.emplace_back();
    part.name = link.name;
    part.line = link.line;
    part.joint = place.joint;
    part.X_iL = place.X_iL;
    part.largest_angle = place.fixed_angle;
    part.shapes = file_.ReadShapes(link);
    part.states_inertial = inertial != nullptr;
    if (inertial == nullptr) return;
    const std::string key = KeyOf(link);
    part.X_LC = file_.ReadOrigin(*inertial, key, &part.largest_angle);
    const auto read = [&](const char* name, const char* attribute) {
      const Element* const element = inertial->FirstChildElement(name);
      if (element == nullptr) file_.Fail(inertial->GetLineNum(), key + name + ": " + attribute + ": missing");
      return file_.ReadNumber(*element, key, attribute);
    };
    // The inertia is given along the axes of the inertial's own frame, which stands at the centre of mass.
    MassProperties body{read("mass", "value"), Vector3d::Zero(), Matrix3d::Zero()};
    for (const auto& [attribute, row, col] :
         {std::tuple("ixx", 0, 0), {"ixy", 0, 1}, {"ixz", 0, 2}, {"iyy", 1, 1}, {"iyz", 1, 2}, {"izz", 2, 2}})
      body.inertia(row, col) = body.inertia(col, row) = read("inertia", attribute);
    const bool is_usable = body.mass >= 0.0 && std::isfinite(body.mass) && body.inertia.allFinite();
    const std::string problem = FindPhysicalInconsistency(body);
    if (!is_usable && !options_.keep_impossible) FailInertial(link, problem);
    if (!problem.empty()) impossible_.push_back({&link, problem, place.joint});
    part.body = ExpressIn(body, part.X_LC);
  }

  [[noreturn]] void FailInertial(const UrdfLink& link, const std::string& problem) const {
    const std::string& file = robot_.spec.source;
    file_.Fail(link.line, KeyOf(link) + "inertial: " + problem + " (dexcheck audit " + file +
                              " reads it all the same, and lists all that is impossible or suspicious)");
  }

  /// Published robots have small parts that no body can be; what counts is the body that they are welded to.
  void JudgeImpossibleParts() {
    if (options_.keep_impossible) return;  // the audit names them
    std::vector<std::string> names;
    for (const ImpossiblePart& part : impossible_) {
      const bool moves = part.joint >= 0 || robot_.spec.base.type != BaseType::kFixed;
      if (moves) {
        const MassProperties& whole = BodyOf(robot_.spec, part.joint);
        if (!FindUndefinedDynamics(whole).empty()) FailInertial(*part.link, part.problem);
        if (!FindPhysicalInconsistency(whole).empty()) continue;  // a note on bodies says so
      }
      names.push_back(part.link->name);
    }
    if (names.empty()) return;
    robot_.notes.push_back("impossible inertials, merged into the link that they are welded to: " +
                           JoinNames(names));
  }

  /// A joint that follows one which follows a third follows the third.
  void ReadCouplings() {
    for (const UrdfJoint& joint : file_.joints()) {
      Joint* const own = FindIn(robot_.spec.joints, joint.name, &Joint::name);
      const Element* mimic = joint.element->FirstChildElement("mimic");
      if (mimic == nullptr || own == nullptr) continue;
      const std::string key = KeyOf(joint) + "mimic: ";
      JointCoupling coupling{-1, 1.0, 0.0};
      std::set<std::string> seen = {joint.name};
      while (mimic != nullptr) {
        coupling.offset += coupling.multiplier * file_.ReadNumber(*mimic, key, "offset", 0.0);
        coupling.multiplier *= file_.ReadNumber(*mimic, key, "multiplier", 1.0);
        const std::string name = ReadAttribute(*mimic, "joint");
        coupling.leader = IndexOf(robot_.spec.joints, name, &Joint::name);
        if (coupling.leader < 0)
          file_.Fail(joint.line, key + "must be a joint that moves, got " + Quote(name));
        if (!seen.insert(name).second) file_.Fail(joint.line, key + "must not be cyclic, got " + Quote(name));
        mimic = FindIn(file_.joints(), name, &UrdfJoint::name)->element->FirstChildElement("mimic");
      }
      own->coupling = coupling;
    }
  }

  void NoteNames() {
    std::vector<std::string> named;
    for (const UrdfJoint& joint : file_.joints()) {
      if (joint.name.starts_with('#'))
        named.push_back(Quote(joint.name) + " moves " + Quote(file_.link(joint.child).name));
    }
    if (!named.empty())
      robot_.notes.push_back("joints without a name, called by their number in the file: " +
                             JoinNames(named));
  }

  void NoteInertials() {
    if (massless_.size() == file_.links().size()) {
      file_.Fail(file_.link(file_.root()).line,
                 "no link has an inertial, so that there are no dynamics, got " +
                     std::to_string(massless_.size()) + " links");
    }
    if (!massless_.empty())
      robot_.notes.push_back("links without inertial, taken as massless: " + JoinNames(massless_));
    std::vector<std::string> idle;
    std::vector<double> carried(robot_.spec.joints.size() + 1, 0.0);
    for (size_t i = robot_.spec.joints.size(); i-- > 0;) {
      const Joint& joint = robot_.spec.joints[i];
      carried[i + 1] += joint.body.mass;
      carried[static_cast<size_t>(joint.parent + 1)] += carried[i + 1];
      if (carried[i + 1] == 0.0) idle.insert(idle.begin(), joint.name);
    }
    if (!idle.empty()) robot_.notes.push_back("joints that move no mass: " + JoinNames(idle));
  }

  const UrdfFile& file_;
  const UrdfOptions& options_;
  int base_ = -1;  // the base's link
  RobotDescription robot_;
  std::vector<std::string> massless_;  // links without an inertial
  /// A link whose own inertial breaks an inequality.
  struct ImpossiblePart {
    const UrdfLink* link;
    std::string problem;
    int joint;  ///< That moves it; -1 the base.
  };
  std::vector<ImpossiblePart> impossible_;
};

}  // namespace

RobotDescription ParseUrdf(std::string_view text, const std::string& source, const UrdfOptions& options) {
  const UrdfFile file(text, source);
  RobotDescription robot = UrdfReader(file, source, options).Read();
  if (options.packages.empty()) return robot;
  const std::vector<std::string> missing =
      file.ListMissingMeshes(std::filesystem::path(source).parent_path(), options.packages);
  if (!missing.empty())
    robot.notes.push_back("meshes that are missing (dynamics need none): " + JoinNames(missing));
  return robot;
}

}  // namespace dexcheck
