#pragma once

// Every scalar parameter of the analytic model by itself: to change it, and to name it.

#include <optional>
#include <string>
#include <vector>

#include "controller/model/robot_model.h"
#include "harness/corrections/correction.h"

namespace dexcheck {

enum class ParameterKind {
  kAlpha,          ///< Of a joint's MDH row, rad.
  kA,              ///< m
  kHomeAngle,      ///< The row's q, rad.
  kD,              ///< m
  kPosition,       ///< Where the row starts on the parent link (`pose`), m.
  kRotation,       ///< The same as roll, pitch, yaw, rad.
  kDryFriction,    ///< Of a joint, N m or N
  kDamping,        ///< Of a joint, N m s/rad or N s/m.
  kArmature,       ///< kg m^2 or kg
  kLowerLimit,     ///< rad or m
  kUpperLimit,     ///< rad or m
  kMass,           ///< Of a link, kg.
  kCom,            ///< m, link frame.
  kInertia,        ///< Ixx, Iyy, Izz, Ixy, Ixz, Iyz about the centre of mass, kg m^2.
  kFramePosition,  ///< Of a named frame on its link, m.
  kFrameRotation,  ///< Roll, pitch, yaw, rad.
  kSphereRadius,   ///< Of a fingertip, m.
  kBasePosition,   ///< Sigma_0 in the world, m.
  kBaseRotation,   ///< Roll, pitch, yaw, rad.
  kWheelRadius,    ///< m
  kWheelDistance,  ///< m
  kWheelMass,      ///< kg
  kWheelSpinInertia,
  kWheelTransverseInertia,
  kWheelArmature,
  kWheelDamping,
  kGravity,           ///< World frame, m/s^2.
  kObjectMass,        ///< kg
  kObjectInertia,     ///< As kInertia.
  kObjectFriction,    ///< mu
  kObjectRingRadius,  ///< Of a torus, m.
  kObjectTubeRadius,
};

/// One number of a RobotSpec.
struct Parameter {
  ParameterKind kind = ParameterKind::kMass;
  int index = -1;     ///< Joint, link (by its joint; -1 the base), or frame.
  int component = 0;  ///< Of a vector, of roll, pitch, yaw, or of the six entries of a tensor.
};

/// All of them: joints first, in the file's order. What the model ignores (the body of a fixed base, the
/// rotation of a moving one) is not among them, nor is dry
/// friction where there is none.
std::vector<Parameter> ListParameters(const RobotSpec& spec);

/// The number of a file's link or joint that it is; none of what no file prints.
std::optional<SiteKind> FindSite(ParameterKind kind);

/// In the units above. The setter leaves the specification unchecked; RobotModel's constructor checks it.
double GetValue(const RobotSpec& spec, const Parameter& parameter);
void SetValue(RobotSpec* spec, const Parameter& parameter, double value);

/// The body of a link, by its joint; -1: of the base.
const MassProperties& BodyOf(const RobotSpec& spec, int link);
MassProperties& BodyOf(RobotSpec* spec, int link);
/// The model of a changed specification; none when there is no such robot.
std::optional<RobotModel> TryModel(const RobotSpec& spec);

/// A length or quantity that a change of the value can be compared with, positive: the value itself, or for a
/// value of zero what stands beside it (the tensor's trace, the link's length, a radian).
double GetScale(const RobotSpec& spec, const Parameter& parameter);

/// The robot with a number changed by `change`, or by as much the other way, which is then the change; none
/// where there is no such robot.
std::optional<RobotModel> TryChange(const RobotSpec& spec, const Parameter& number, double* change);

/// The robot with a number changed by `scale` times GetScale, or by as much less where there is no such
/// robot.
/// @throws InputError when there is neither.
RobotModel ChangeNumber(RobotSpec spec, const Parameter& number, double scale);

/// The part of the robot: "joint r_elbow", "link r_forearm", "frame rf1_tip", "base platform", "object
/// torus", "gravity".
std::string DescribePart(const RobotSpec& spec, const Parameter& parameter);
/// The quantity: "alpha", "mass", "centre of mass x", "Ixy".
std::string DescribeQuantity(const Parameter& parameter);
/// The vector or tensor that a component belongs to: "centre of mass", "inertia"; otherwise DescribeQuantity.
std::string DescribeGroup(const Parameter& parameter);
}  // namespace dexcheck
