#pragma once

// The robot as the analytic model sees it: a base and a tree of MDH joints. Immutable once built.

#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "controller/common/types.h"
#include "controller/model/rigid_body.h"

namespace dexcheck {

/// One row of a table of modified Denavit-Hartenberg parameters (Craig's convention, Figure 3).
struct MdhRow {
  double alpha = 0.0;  ///< Angle from Z_{i-1} to Z_i about X_{i-1}, rad.
  double a = 0.0;      ///< Distance from Z_{i-1} to Z_i along X_{i-1}, m.
  double q = 0.0;      ///< Home angle from X_{i-1} to X_i about Z_i, rad (the table's q column).
  double d = 0.0;      ///< Distance from X_{i-1} to X_i along Z_i, m.
};

/// ^{i-1}T_i = Rot(x, alpha) Trans(x, a) Rot(z, q) Trans(z, d), equation (4).
/// @param theta total angle about Z_i, rad.
/// @param d total displacement along Z_i, m.
inline Pose CalcMdhTransform(double alpha, double a, double theta, double d) {
  const double ca = std::cos(alpha);
  const double sa = std::sin(alpha);
  const double cq = std::cos(theta);
  const double sq = std::sin(theta);
  Pose T;
  // clang-format off
  T.matrix() << cq,      -sq,       0.0,   a,
                sq * ca,  cq * ca, -sa,   -d * sa,
                sq * sa,  cq * sa,  ca,    d * ca,
                0.0,      0.0,      0.0,   1.0;
  // clang-format on
  return T;
}

enum class BaseType {
  kFixed,              ///< No coordinates.
  kPlanar,             ///< q_v = [x, y, phi], v = q_v_dot.
  kDifferentialDrive,  ///< q_v = [x_c, y_c, phi] with the constraint (1); v has two entries (12).
  /// q_v = [x, y, z, qw, qx, qy, qz], origin and unit quaternion of Sigma_0 in the world; v = [velocity of
  /// the origin in world axes; angular velocity in Sigma_0's axes]. q_v_dot is no velocity of the model: the
  /// unreduced coordinates have v too.
  kFloating,
};

/// The two choices of v in (12) for a differential drive.
enum class DriveVelocity {
  kTwist,       ///< v = [v_c, w_c]: forward speed of the axle's midpoint, m/s; yaw rate, rad/s.
  kWheelRates,  ///< v = [thetadot_r, thetadot_l]: wheel rates, rad/s, positive rolls forward.
};

/// One of the two driving wheels, which are identical.
struct WheelProperties {
  double mass = 0.0;                ///< kg, centred on the axle at +-b/2.
  double spin_inertia = 0.0;        ///< About the axle, kg m^2.
  double transverse_inertia = 0.0;  ///< About any diameter, kg m^2.
  double armature = 0.0;            ///< Reflected rotor inertia, kg m^2.
  double damping = 0.0;             ///< Viscous, N m s/rad.
};

/// The link that carries the tree. Its frame Sigma_0 has z up; for a differential drive the origin is the
/// midpoint of the wheel axle and x points forward.
struct Base {
  BaseType type = BaseType::kFixed;
  std::string link = "base";
  MassProperties body;  ///< Without the wheels, in Sigma_0. Ignored for a fixed base.
  /// Sigma_0 in the world frame Sigma_B at q_v = 0; turned only when fixed, the identity when floating.
  Pose X_B0 = Pose::Identity();

  // Differential drive only.
  DriveVelocity velocity = DriveVelocity::kTwist;
  double wheel_radius = 0.0;    ///< r, m.
  double wheel_distance = 0.0;  ///< b, m.
  WheelProperties wheel;
  std::string wheel_joint_right;
  std::string wheel_joint_left;
};

enum class JointType {
  kRevolute,
  kPrismatic,
  /// Turns about all axes. Of q' it has a unit quaternion qw qx qy qz, which turns frame i from X_PB; of xi
  /// the components of the link's angular velocity against the parent, along the link's own axes. Its MDH row
  /// is zeros. Range: of the angle of that turn, from 0.
  kBall,
};

/// Entries of q' that a joint has: four of a ball joint, else one.
constexpr int CountPositions(JointType type) { return type == JointType::kBall ? 4 : 1; }
/// Entries of xi that a joint has: three of a ball joint, else one.
constexpr int CountVelocities(JointType type) { return type == JointType::kBall ? 3 : 1; }

/// "revolute", "prismatic", "ball": as files and programs say it.
const char* NameOf(JointType type);

/// A joint that follows another one: q_i = multiplier q_leader + offset (rad or m).
struct JointCoupling {
  int leader = -1;  ///< Index of the joint that is followed, which follows none itself.
  double multiplier = 1.0;
  double offset = 0.0;  ///< rad or m
};

/// A joint and the link that it moves. Frame i of the link follows from its parent's by
/// X_PB (usually identity), then the MDH row with q_i added to theta (revolute) or to d (prismatic).
struct Joint {
  std::string name;
  std::string link;
  int parent = -1;  ///< Index of the joint that moves the parent link; -1 is the base.
  JointType type = JointType::kRevolute;
  Pose X_PB = Pose::Identity();  ///< Where the MDH row starts, in the parent link's frame.
  MdhRow mdh;
  double lower = 0.0;  ///< Range of q_i, rad or m.
  double upper = 0.0;
  double damping = 0.0;   ///< Viscous friction, N m s/rad or N s/m.
  double armature = 0.0;  ///< Reflected rotor inertia, kg m^2 or kg.
  MassProperties body;    ///< Of the link, in frame i.

  // No part of F, which is smooth: the force -dry_friction sign(q_i_dot) stands beside it, and the terms are
  // those of all joints, of which CalcCouplingMap (harness/descriptions) takes those that are free.
  double dry_friction = 0.0;  ///< Coulomb friction, N m or N.
  std::optional<JointCoupling> coupling;
  /// Axes of the link's own frame, in which the file gives its body, in frame i.
  Matrix3d R_iL = Matrix3d::Identity();
};

/// A frame fixed to a link; a fingertip when it carries a sphere.
struct Frame {
  std::string name;
  int link = -1;  ///< Index of the joint that moves the link; -1 is the base.
  Pose X_LF = Pose::Identity();
  std::optional<double> sphere_radius;  ///< Of the fingertip's sphere, centred at the frame's origin, m.
};

/// The manipulated object (section 3.3), a free rigid body. Its frame Sigma_o stands at its centre of mass.
struct ObjectModel {
  std::string name;
  Shape shape;
  MassProperties body;    ///< com is zero.
  double friction = 0.0;  ///< mu of (21) between fingertip and object.
};

/// Robot as a parameter file describes it. RobotModel(spec) checks it.
struct RobotSpec {
  std::string name;
  std::string source;                 ///< File, for messages.
  Vector3d gravity{0.0, 0.0, -9.81};  ///< In the world frame, m/s^2.
  Base base;
  std::vector<Joint> joints;  ///< Parents before children; this is the order of q and xi.
  std::vector<Frame> frames;
  std::optional<ObjectModel> object;
};

/// Immutable model: the specification, checked, with the tree's derived structure.
class RobotModel {
 public:
  /// @throws InputError when the specification cannot be a robot (names, order, masses, ranges).
  explicit RobotModel(RobotSpec spec);

  [[nodiscard]] const RobotSpec& spec() const { return spec_; }
  [[nodiscard]] const std::string& name() const { return spec_.name; }
  [[nodiscard]] const Vector3d& gravity() const { return spec_.gravity; }
  [[nodiscard]] const Base& base() const { return spec_.base; }
  [[nodiscard]] const std::vector<Joint>& joints() const { return spec_.joints; }
  [[nodiscard]] const std::vector<Frame>& frames() const { return spec_.frames; }
  /// One of them. @throws std::out_of_range.
  [[nodiscard]] const Joint& joint(int index) const { return spec_.joints.at(static_cast<size_t>(index)); }
  [[nodiscard]] const Frame& frame(int index) const { return spec_.frames.at(static_cast<size_t>(index)); }
  [[nodiscard]] const std::optional<ObjectModel>& object() const { return spec_.object; }

  /// Number of joints of the tree (without the base and the wheels).
  [[nodiscard]] int num_joints() const { return static_cast<int>(spec_.joints.size()); }
  /// Entries of q_v: 0, 3, or 7.
  [[nodiscard]] int num_base_positions() const;
  /// Entries of v: 0, 3, 2, or 6.
  [[nodiscard]] int num_base_velocities() const;
  /// Entries of the base's velocity in unreduced coordinates: of q_v_dot, or of v for a floating base.
  [[nodiscard]] int num_unreduced_base_velocities() const;
  /// Velocities of all joints of the tree, which follow the base's in xi and q_dot'.
  [[nodiscard]] int num_dofs() const { return static_cast<int>(dof_joints_.size()); }
  /// p', entries of q': 51 for the paper's robot.
  [[nodiscard]] int num_positions() const { return num_positions_; }
  /// p' - r, entries of xi: 50 for the paper's robot.
  [[nodiscard]] int num_velocities() const { return num_base_velocities() + num_dofs(); }
  /// First entry of q' that a joint has.
  [[nodiscard]] int position_index(int joint) const { return position_indices_[static_cast<size_t>(joint)]; }
  /// First velocity that a joint has, counted from the base's: xi has it at num_base_velocities() +
  /// dof(joint).
  [[nodiscard]] int dof(int joint) const { return dofs_[static_cast<size_t>(joint)]; }
  /// The joint that has a velocity, counted from the base's.
  [[nodiscard]] int joint_of_dof(int dof) const { return dof_joints_[static_cast<size_t>(dof)]; }
  /// Name of a velocity, counted from the base's: the joint's, of a ball joint "name:x", "name:y", "name:z".
  [[nodiscard]] std::string dof_name(int dof) const;

  /// Index of a joint by name; -1 when there is none.
  [[nodiscard]] int FindJoint(std::string_view name) const;
  /// Index of the joint that moves a link, by the link's name; -1 for the base's link.
  /// @throws std::invalid_argument when there is no such link.
  [[nodiscard]] int FindLink(std::string_view name) const;
  /// Index of a frame by name. @throws std::invalid_argument when there is none.
  [[nodiscard]] int FindFrame(std::string_view name) const;
  /// Indices of the fingertip frames, in the file's order (R1..R4, L1..L4 for the paper's robot).
  [[nodiscard]] const std::vector<int>& fingertips() const { return fingertips_; }
  /// Radius of the sphere that a fingertip's frame carries, m.
  /// @throws std::invalid_argument when it carries none.
  [[nodiscard]] double tip_radius(int frame) const;
  /// Joints from the base to the one that moves a link, itself last; none for the base's link, -1.
  [[nodiscard]] std::vector<int> ListChain(int link) const;
  /// Entries of xi that move a link, ascending: the base's, then those of its chain.
  [[nodiscard]] std::vector<int> ListMovingEntries(int link) const;
  /// Name of a link by the index of its joint; -1 is the base's link.
  [[nodiscard]] const std::string& link_name(int joint) const;

  /// Joints in depth-first order, children in declared order. Writing each joint's velocities to the entries
  /// that end at depth - 1 of an array keeps its whole chain to the base in the entries before them.
  [[nodiscard]] std::span<const int> depth_first() const { return depth_first_; }
  /// Number of velocities of the joints from the base to this one, itself included.
  [[nodiscard]] int depth(int joint) const { return depth_[static_cast<size_t>(joint)]; }
  [[nodiscard]] int max_depth() const { return max_depth_; }

  /// Pose of Sigma_0 in the world at q' (num_positions entries).
  [[nodiscard]] Pose CalcBasePose(const Eigen::Ref<const VectorXd>& q) const;

  /// The base's link with the wheels as part of it (their mass at +-b/2 on the axle), in Sigma_0.
  [[nodiscard]] const MassProperties& base_with_wheels() const { return base_with_wheels_; }

 private:
  RobotSpec spec_;
  std::vector<int> fingertips_;
  std::vector<int> depth_first_;
  std::vector<int> depth_;
  int max_depth_ = 0;
  int num_positions_ = 0;
  std::vector<int> position_indices_, dofs_;  // by joint
  std::vector<int> dof_joints_;
  MassProperties base_with_wheels_;
};

/// @param where "in a run, ...": what does not know ball joints.
/// @throws InputError "FILE: joint NAME: must not be a ball joint WHERE" when the model has one.
void RequireNoBalls(const RobotModel& model, const std::string& where);

}  // namespace dexcheck
