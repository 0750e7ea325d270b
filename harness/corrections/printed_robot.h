#pragma once

// A robot as its file prints it: every number with its precision, rotations in the file's own form, each link
// in its own frame.

#include <array>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "controller/common/types.h"
#include "controller/model/rigid_body.h"
#include "harness/descriptions/robot_description.h"

namespace dexcheck {

using Vector4d = Eigen::Vector4d;

/// A number and half a unit of its last digit; 0: it is exact.
struct PrintedScalar {
  double value = 0.0;
  double half = 0.0;
  bool operator==(const PrintedScalar&) const = default;
};

/// How a file writes a rotation.
enum class RotationForm {
  kNone,          ///< It writes none.
  kRollPitchYaw,  ///< R = Rz(yaw) Ry(pitch) Rx(roll), rad.
  kEuler,         ///< Angles about `sequence`: small letters are moving axes, capitals fixed ones.
  kQuaternion,    ///< w, x, y, z.
  kMdh,           ///< alpha and q of a row of modified Denavit-Hartenberg parameters; t is (a, 0, d).
};

/// A pose as printed.
struct PrintedOrigin {
  Vector3d t = Vector3d::Zero(), half_t = Vector3d::Zero();  ///< m
  Vector4d r = Vector4d::Zero(), half_r = Vector4d::Zero();  ///< Numbers of the form; angles in rad.
  RotationForm form = RotationForm::kNone;
  std::array<char, 3> sequence = {'x', 'y', 'z'};
  Pose X_before = Pose::Identity();  ///< Of a row of a table, what stands before it.

  [[nodiscard]] Matrix3d CalcRotation() const;
  [[nodiscard]] Pose CalcPose() const;
  void TakePlace(const PrintedOrigin& other) {
    t = other.t;
    half_t = other.half_t;
  }
  /// Takes another rotation, in the form of a quaternion unless it is roll, pitch, yaw.
  void SetRotation(const Matrix3d& R);
  /// Takes the row behind X_before that is nearest to a pose.
  void SetRow(const Pose& pose);
};

/// The mass and inertia of one element.
struct PrintedInertial {
  PrintedScalar mass;    ///< kg
  PrintedOrigin origin;  ///< Centre of mass and the axes of the inertia, in the link's frame.
  /// xx yy zz xy xz yz about the centre, kg m^2.
  Vector6d I = Vector6d::Zero(), half_I = Vector6d::Zero();  // NOLINT(readability-identifier-naming)
};

bool IsTurned(const PrintedOrigin& x, const PrintedOrigin& y);
bool IsOther(const PrintedOrigin& x, const PrintedOrigin& y);
bool IsOther(const std::optional<PrintedInertial>& x, const std::optional<PrintedInertial>& y);

enum class JointKind { kFixed, kHinge, kSlide, kBall, kFree };

struct PrintedMimic {
  std::string leader;
  PrintedScalar multiplier{1.0, 0.0}, offset;
  bool operator==(const PrintedMimic&) const = default;
};

/// A scalar of a joint; a file that does not state it has no value.
enum class JointScalar {
  kDamping,
  kFriction,
  kArmature,
  kEffort,
  kVelocity,
  kStiffness,
  kSpringAngle,
  kGear
};
inline constexpr size_t kNumJointScalars = 8;

struct PrintedJoint {
  std::string name;
  JointKind kind = JointKind::kFixed;
  Vector3d axis = Vector3d::UnitZ(), half_axis = Vector3d::Zero();
  bool states_axis = true;             ///< Whether the file does; a URDF's joint without it has (1 0 0).
  Vector3d anchor = Vector3d::Zero();  ///< A point of the axis, in the link's frame, m.
  std::optional<std::array<PrintedScalar, 2>> range;
  std::array<std::optional<PrintedScalar>, kNumJointScalars> scalars;
  std::optional<PrintedMimic> mimic;
  double ref = 0.0;  ///< Of an MJCF: its position where its body stands as the file places it.
};

/// An inertial that a setting of an MJCF's compiler changed.
struct CompiledInertial {
  std::string setting;      ///< "boundmass"
  PrintedInertial stated;   ///< In the text.
  std::string description;  ///< "mass 0.31 in the text, 0.5 in the engine"
};

struct PrintedLink {
  std::string name;
  int parent = -1;
  std::vector<int> children;
  PrintedOrigin origin;  ///< In the parent's frame, or in the world, at zero.
  PrintedJoint joint;    ///< That moves it.
  std::optional<PrintedInertial> inertial;
  std::optional<CompiledInertial> compiled;
  /// Its row read by the modified convention, if the file says that its rows are classic ones.
  std::optional<PrintedOrigin> as_modified;
  bool is_frame = false;        ///< It is no link, but a frame on its parent.
  bool is_from_shapes = false;  ///< The file states no inertial: the engine computed it from the shapes.
};

/// How a constraint begins that is a servo in the place of a motor, as the motors of many MJCFs are.
inline constexpr const char* kServo = "servo at";

/// A motor or servo of a joint.
struct PrintedMotor {
  std::string name;
  int link = -1;  ///< That its joint moves.
  double gear = 1.0;
  std::optional<PrintedScalar> effort;  ///< Largest force, where it is the same in both directions.
  std::string servo;                    ///< "(kp 5, kv 0.1)"; empty of a motor, whose force is its control.
  bool operator==(const PrintedMotor&) const = default;
};

struct PrintedRobot {
  std::string source;
  RobotFormat format = RobotFormat::kUrdf;
  std::vector<PrintedLink> links;  ///< Parents before children; the first is the root.
  std::optional<Vector3d> gravity;
  std::optional<bool> floats;            ///< Whether the root does; none where the file does not say it.
  std::vector<std::string> constraints;  ///< Between links, and springs and dampers between joints.
  bool has_motors = false;               ///< The file states motors.
  std::vector<PrintedMotor> motors;      ///< Of an MJCF.

  [[nodiscard]] const PrintedLink& link(int index) const { return links[static_cast<size_t>(index)]; }
  [[nodiscard]] PrintedLink& link(int index) { return links[static_cast<size_t>(index)]; }
  [[nodiscard]] int size() const { return static_cast<int>(links.size()); }
  /// Adds a link below another one. @return its index.
  int Add(PrintedLink link);
};

/// Gives each joint the sum of the gears of its motors and the largest force that all of them may exert, and
/// the robot its servos as constraints, since these pull at a joint whatever their control is.
void TakeMotors(PrintedRobot* robot);

/// A printed number and half a unit of its last digit.
struct LinkNumber {
  double* value;
  double* half;
};
/// Place and rotation; mass, centre, rotation and entries.
std::vector<LinkNumber> ListNumbers(PrintedOrigin* origin);
std::vector<LinkNumber> ListNumbers(PrintedInertial* inertial);

/// Calls visit() with each of the numbers moved by its half unit.
template <typename Visit>
void MoveHalves(const std::vector<LinkNumber>& numbers, const Visit& visit) {
  for (const LinkNumber& number : numbers) {
    if (*number.half <= 0.0) continue;
    const double value = *number.value;
    *number.value = value + *number.half;
    visit();
    *number.value = value;
  }
}

/// Both solutions for roll, pitch, yaw of a rotation; at a quarter turn of pitch, yaw or roll is 0.
std::array<Vector3d, 2> SolveRollPitchYaw(const Matrix3d& R);
Matrix3d TurnAbout(int axis, double angle);
/// The quaternion w, x, y, z with w >= 0, and back (of any length).
Vector4d ToQuaternion(const Matrix3d& R);
Matrix3d TurnQuaternion(const Vector4d& wxyz);
/// Rotation vector and angle.
Vector3d CalcRotationVector(const Matrix3d& R);
double CalcAngle(const Matrix3d& R);
/// The rotations that turn the principal axes of one tensor into those of another.
std::vector<Matrix3d> ListAxesTurns(const Matrix3d& from, const Matrix3d& to);

/// Numbers that were printed with more digits than the file's others of their kind are known no better: gives
/// them the median half unit.
void LevelPrecision(PrintedRobot* robot);

}  // namespace dexcheck
