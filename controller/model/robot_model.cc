#include "controller/model/robot_model.h"

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/linear_algebra.h"
#include "controller/common/text.h"

namespace dexcheck {
namespace {

/// One wheel at the given place on the axle (y of Sigma_0, m), in Sigma_0.
MassProperties CalcWheel(const WheelProperties& wheel, double y) {
  // The wheel spins about the axle, y_0; about any diameter its inertia is the same.
  const Vector3d moments(wheel.transverse_inertia, wheel.spin_inertia, wheel.transverse_inertia);
  return {wheel.mass, Vector3d(0.0, y, 0.0), moments.asDiagonal()};
}

MassProperties CalcBaseWithWheels(const Base& base) {
  if (base.type != BaseType::kDifferentialDrive) return base.body;
  const double half = 0.5 * base.wheel_distance;
  return Combine({base.body, CalcWheel(base.wheel, half), CalcWheel(base.wheel, -half)});
}

/// Checks a specification entry by entry; every failure is an InputError "FILE: KEY: what, got VALUE".
class SpecChecker {
 public:
  explicit SpecChecker(const RobotSpec& spec) : spec_(spec) {}

  void CheckAll() {
    for (const double g : spec_.gravity) CheckFinite("gravity", g);
    CheckBase(spec_.base);
    for (size_t i = 0; i < spec_.joints.size(); ++i) CheckJoint(spec_.joints[i], static_cast<int>(i));
    for (const Frame& frame : spec_.frames) CheckFrame(frame);
    if (spec_.object) CheckObject(*spec_.object);
  }

 private:
  [[noreturn]] void Fail(const std::string& key, const std::string& problem) const {
    throw InputError(spec_.source + ": " + key + ": " + problem);
  }

  void Check(bool condition, const std::string& key, const std::string& requirement, double value) const {
    if (!condition) Fail(key, requirement + ", got " + FormatNumber(value));
  }
  void CheckFinite(const std::string& key, double value) const {
    Check(std::isfinite(value), key, "must be finite", value);
  }
  void CheckPositive(const std::string& key, double value) const {
    Check(std::isfinite(value) && value > 0.0, key, "must be finite and positive", value);
  }
  void CheckNotNegative(const std::string& key, double value) const {
    Check(std::isfinite(value) && value >= 0.0, key, "must be finite and not negative", value);
  }

  void CheckPose(const std::string& key, const Pose& X) const {
    for (const double entry : X.matrix().reshaped()) CheckFinite(key, entry);
    // A product of rotations is orthonormal to a few eps for each; chains have tens of them.
    constexpr double kAllowance = 1024.0 * std::numeric_limits<double>::epsilon();
    const double residual = (X.linear().transpose() * X.linear() - Matrix3d::Identity()).norm();
    Check(residual <= kAllowance, key, "must be a rotation, |R^T R - I| = 0", residual);
    Check(X.linear().determinant() > 0.0, key, "must be a right-handed rotation, det R = 1",
          X.linear().determinant());
  }

  /// Links come from published descriptions, some of which break the triangle inequality.
  void CheckLink(const std::string& key, const MassProperties& body) const {
    const std::string problem = FindUndefinedDynamics(body);
    if (!problem.empty()) Fail(key, problem);
  }
  void CheckBody(const std::string& key, const MassProperties& body) const {
    const std::string problem = FindPhysicalInconsistency(body);
    if (!problem.empty()) Fail(key, problem);
  }

  void CheckUnique(std::set<std::string>& names, const std::string& key, const std::string& name) const {
    if (name.empty()) Fail(key, "must not be empty, got \"\"");
    if (!names.insert(name).second) Fail(key, "must be unique, got " + Quote(name) + " again");
  }

  void CheckBase(const Base& base) {
    CheckUnique(link_names_, "base.link", base.link);
    CheckPose("base.pose", base.X_B0);
    if (base.type != BaseType::kFixed) {
      // Its heading is q_v's third entry, and its z axis stays vertical.
      Check(base.X_B0.linear().isIdentity(0.0), "base.pose",
            "must not be turned unless the base is fixed, angle 0",
            Eigen::AngleAxisd(base.X_B0.linear()).angle());
      CheckLink("base", base.body);
    }
    if (base.type == BaseType::kFloating) {
      Check(base.X_B0.translation().isZero(0.0), "base.pose",
            "must not stand beside a floating base, distance 0", base.X_B0.translation().norm());
    }
    if (base.type != BaseType::kDifferentialDrive) return;
    CheckPositive("base.wheel_radius", base.wheel_radius);
    CheckPositive("base.wheel_distance", base.wheel_distance);
    CheckNotNegative("base.wheels.mass", base.wheel.mass);
    CheckNotNegative("base.wheels.spin_inertia", base.wheel.spin_inertia);
    CheckNotNegative("base.wheels.transverse_inertia", base.wheel.transverse_inertia);
    CheckNotNegative("base.wheels.armature", base.wheel.armature);
    CheckNotNegative("base.wheels.damping", base.wheel.damping);
    CheckBody("base.wheels", CalcWheel(base.wheel, 0.0));
    CheckLink("base with wheels", CalcBaseWithWheels(base));
    CheckUnique(joint_names_, "base.wheels.right", base.wheel_joint_right);
    CheckUnique(joint_names_, "base.wheels.left", base.wheel_joint_left);
  }

  void CheckJoint(const Joint& joint, int index) {
    CheckUnique(joint_names_, "joint " + Quote(joint.name) + ": name", joint.name);
    const std::string key = "joint " + Quote(joint.name) + ": ";
    CheckUnique(link_names_, key + "link", joint.link);
    Check(-1 <= joint.parent && joint.parent < index, key + "parent",
          "must be -1 (the base) or an earlier joint than " + std::to_string(index), joint.parent);
    CheckPose(key + "pose", joint.X_PB);
    CheckFinite(key + "alpha", joint.mdh.alpha);
    CheckFinite(key + "a", joint.mdh.a);
    CheckFinite(key + "q", joint.mdh.q);
    CheckFinite(key + "d", joint.mdh.d);
    CheckFinite(key + "range", joint.lower);
    CheckFinite(key + "range", joint.upper);
    if (joint.type == JointType::kBall) CheckBall(key, joint);
    Check(joint.lower <= joint.upper, key + "range",
          "lower limit must not exceed upper limit " + FormatNumber(joint.upper), joint.lower);
    CheckNotNegative(key + "damping", joint.damping);
    CheckNotNegative(key + "armature", joint.armature);
    CheckNotNegative(key + "dry_friction", joint.dry_friction);
    if (joint.coupling) CheckCoupling(key + "mimic", *joint.coupling, index);
    CheckLink("link " + Quote(joint.link), joint.body);
  }

  void CheckBall(const std::string& key, const Joint& joint) const {
    Check(joint.lower == 0.0, key + "range", "must begin at 0 for a ball joint", joint.lower);
    const MdhRow& row = joint.mdh;
    Check(row.alpha == 0.0 && row.a == 0.0 && row.q == 0.0 && row.d == 0.0, key + "row",
          "must be a plain transform for a ball joint, zeros", row.alpha + row.a + row.q + row.d);
    if (joint.coupling) Fail(key + "mimic", "must not be given for a ball joint");
  }

  void CheckCoupling(const std::string& key, const JointCoupling& coupling, int index) const {
    const bool is_joint = 0 <= coupling.leader && coupling.leader < static_cast<int>(spec_.joints.size());
    Check(is_joint && coupling.leader != index, key, "must be another joint, index of one", coupling.leader);
    const Joint& leader = spec_.joints[static_cast<size_t>(coupling.leader)];
    if (leader.type == JointType::kBall) Fail(key, "must be no ball joint, got " + Quote(leader.name));
    if (leader.coupling) Fail(key, "must be a joint that follows none, got " + Quote(leader.name));
    CheckFinite(key + ".multiplier", coupling.multiplier);
    CheckFinite(key + ".offset", coupling.offset);
  }

  void CheckFrame(const Frame& frame) {
    CheckUnique(frame_names_, "frame " + Quote(frame.name) + ": name", frame.name);
    const std::string key = "frame " + Quote(frame.name) + ": ";
    Check(-1 <= frame.link && frame.link < static_cast<int>(spec_.joints.size()), key + "link",
          "must be -1 (the base) or the index of a joint", frame.link);
    CheckPose(key + "pose", frame.X_LF);
    if (frame.sphere_radius) CheckPositive(key + "sphere_radius", *frame.sphere_radius);
  }

  void CheckObject(const ObjectModel& object) const {
    CheckBody("object", object.body);
    CheckPositive("object.mass", object.body.mass);
    Check(object.body.com.isZero(0.0), "object.com", "must be the origin of the object's frame, distance 0",
          object.body.com.norm());
    CheckPositive("object.friction", object.friction);
  }

  const RobotSpec& spec_;
  std::set<std::string> joint_names_;
  std::set<std::string> link_names_;
  std::set<std::string> frame_names_;
};

std::vector<int> SortDepthFirst(const std::vector<Joint>& joints) {
  std::map<int, std::vector<int>> children;  // By parent, in declared order.
  for (size_t i = 0; i < joints.size(); ++i) children[joints[i].parent].push_back(static_cast<int>(i));

  std::vector<int> order;
  std::vector<int> open(children[-1].rbegin(), children[-1].rend());
  while (!open.empty()) {
    const int joint = open.back();
    open.pop_back();
    order.push_back(joint);
    open.insert(open.end(), children[joint].rbegin(), children[joint].rend());
  }
  return order;
}

/// Index of the first entry whose `member` is `name`; -1 when there is none.
template <typename T>
int FindByName(const std::vector<T>& entries, std::string T::*member, std::string_view name) {
  const auto found = std::ranges::find_if(entries, [&](const T& entry) { return entry.*member == name; });
  return found == entries.end() ? -1 : static_cast<int>(found - entries.begin());
}

}  // namespace

const char* NameOf(JointType type) {
  if (type == JointType::kBall) return "ball";
  return type == JointType::kPrismatic ? "prismatic" : "revolute";
}

RobotModel::RobotModel(RobotSpec spec) : spec_(std::move(spec)) {
  SpecChecker(spec_).CheckAll();
  depth_first_ = SortDepthFirst(spec_.joints);
  num_positions_ = num_base_positions();
  for (int i = 0; i < num_joints(); ++i) {
    const Joint& joint = spec_.joints[static_cast<size_t>(i)];
    const int velocities = CountVelocities(joint.type);
    depth_.push_back((joint.parent < 0 ? 0 : depth(joint.parent)) + velocities);
    max_depth_ = std::max(max_depth_, depth_.back());
    position_indices_.push_back(num_positions_);
    num_positions_ += CountPositions(joint.type);
    dofs_.push_back(num_dofs());
    dof_joints_.insert(dof_joints_.end(), static_cast<size_t>(velocities), i);
  }
  for (size_t i = 0; i < spec_.frames.size(); ++i) {
    if (spec_.frames[i].sphere_radius) fingertips_.push_back(static_cast<int>(i));
  }
  base_with_wheels_ = CalcBaseWithWheels(spec_.base);
}

int RobotModel::num_base_positions() const {
  if (spec_.base.type == BaseType::kFixed) return 0;
  return spec_.base.type == BaseType::kFloating ? 7 : 3;
}

int RobotModel::num_base_velocities() const {
  return spec_.base.type == BaseType::kDifferentialDrive ? 2 : num_unreduced_base_velocities();
}

int RobotModel::num_unreduced_base_velocities() const {
  return spec_.base.type == BaseType::kFloating ? 6 : num_base_positions();
}

Pose RobotModel::CalcBasePose(const Eigen::Ref<const VectorXd>& q) const {
  Pose X_B0 = spec_.base.X_B0;
  if (spec_.base.type == BaseType::kFixed) return X_B0;
  if (spec_.base.type == BaseType::kFloating) {
    X_B0.linear() = Eigen::Quaterniond(q[3], q[4], q[5], q[6]).normalized().toRotationMatrix();
    X_B0.translation() = q.head<3>();
    return X_B0;
  }
  X_B0.linear() = Eigen::AngleAxisd(q[2], Vector3d::UnitZ()).toRotationMatrix();
  X_B0.translation() += Vector3d(q[0], q[1], 0.0);
  return X_B0;
}

std::string RobotModel::dof_name(int dof) const {
  const int joint = joint_of_dof(dof);
  const Joint& owner = spec_.joints[static_cast<size_t>(joint)];
  if (owner.type != JointType::kBall) return owner.name;
  return owner.name + ":" + "xyz"[dof - this->dof(joint)];
}

int RobotModel::FindJoint(std::string_view name) const {
  return FindByName(spec_.joints, &Joint::name, name);
}

int RobotModel::FindLink(std::string_view name) const {
  if (name == spec_.base.link) return -1;
  const int joint = FindByName(spec_.joints, &Joint::link, name);
  if (joint < 0) throw std::invalid_argument("link: must exist in " + spec_.source + ", got " + Quote(name));
  return joint;
}

int RobotModel::FindFrame(std::string_view name) const {
  const int frame = FindByName(spec_.frames, &Frame::name, name);
  if (frame < 0) throw std::invalid_argument("frame: must exist in " + spec_.source + ", got " + Quote(name));
  return frame;
}

double RobotModel::tip_radius(int frame) const {
  const Frame& tip = this->frame(frame);
  if (!tip.sphere_radius) throw std::invalid_argument("fingertips: " + tip.name + " carries no sphere");
  return *tip.sphere_radius;
}

std::vector<int> RobotModel::ListChain(int link) const {
  std::vector<int> chain;
  for (int joint = link; joint >= 0; joint = this->joint(joint).parent) chain.push_back(joint);
  std::ranges::reverse(chain);
  return chain;
}

std::vector<int> RobotModel::ListMovingEntries(int link) const {
  const int base = num_base_velocities();
  std::vector<int> entries = ListIndices(base);
  for (const int index : ListChain(link)) {
    for (int k = 0; k < CountVelocities(joint(index).type); ++k) entries.push_back(base + dof(index) + k);
  }
  return entries;
}

const std::string& RobotModel::link_name(int joint) const {
  return joint < 0 ? spec_.base.link : spec_.joints.at(static_cast<size_t>(joint)).link;
}

void RequireNoBalls(const RobotModel& model, const std::string& where) {
  for (const Joint& joint : model.joints()) {
    if (joint.type != JointType::kBall) continue;
    throw InputError(model.spec().source + ": joint " + Quote(joint.name) + ": must not be a ball joint " +
                     where);
  }
}

}  // namespace dexcheck
