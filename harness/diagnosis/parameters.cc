#include "harness/diagnosis/parameters.h"

#include <array>
#include <cmath>
#include <iterator>

#include "controller/common/errors.h"

namespace dexcheck {
namespace {

using Kind = ParameterKind;

struct KindText {
  const char* name;
  const char* unit;
};

/// In the order of the enumeration.
constexpr KindText kTexts[] = {
    {"alpha", "deg"},
    {"a", "m"},
    {"q (home angle)", "deg"},
    {"d", "m"},
    {"position", "m"},
    {"rotation", "deg"},
    {"damping", "N m s/rad"},
    {"armature", "kg m^2"},
    {"dry friction", "N m"},
    {"lower limit", "m"},
    {"upper limit", "m"},
    {"mass", "kg"},
    {"centre of mass", "m"},
    {"inertia", "kg m^2"},
    {"position", "m"},
    {"rotation", "deg"},
    {"fingertip radius", "m"},
    {"position", "m"},
    {"rotation", "deg"},
    {"wheel radius", "m"},
    {"wheel distance", "m"},
    {"wheel mass", "kg"},
    {"wheel spin inertia", "kg m^2"},
    {"wheel transverse inertia", "kg m^2"},
    {"wheel armature", "kg m^2"},
    {"wheel damping", "N m s/rad"},
    {"gravity", "m/s^2"},
    {"mass", "kg"},
    {"inertia", "kg m^2"},
    {"friction", ""},
    {"ring radius", "m"},
    {"tube radius", "m"},
};
static_assert(std::size(kTexts) == static_cast<size_t>(Kind::kObjectTubeRadius) + 1);

const KindText& TextOf(const Parameter& p) { return kTexts[static_cast<size_t>(p.kind)]; }

/// Place of Ixx, Iyy, Izz, Ixy, Ixz, Iyz in a 3x3 matrix; and of its mirror image.
int EntryOf(const Parameter& p) { return std::array{0, 4, 8, 3, 6, 7}[static_cast<size_t>(p.component)]; }
int MirrorEntryOf(const Parameter& p) {
  return std::array{0, 4, 8, 1, 2, 5}[static_cast<size_t>(p.component)];
}

bool IsTensor(const Parameter& p) { return p.kind == Kind::kInertia || p.kind == Kind::kObjectInertia; }

/// Roll, pitch, yaw of R = Rot(z, yaw) Rot(y, pitch) Rot(x, roll).
Vector3d ToRpy(const Matrix3d& R) {
  const double pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  constexpr double kUpright = 1e-9;  // roll and yaw then turn about one axis: roll is taken as zero
  if (std::hypot(R(0, 0), R(1, 0)) < kUpright) return {0.0, pitch, std::atan2(-R(0, 1), R(1, 1))};
  return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
}

Matrix3d FromRpy(const Vector3d& rpy) {
  return (Eigen::AngleAxisd(rpy.z(), Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy.x(), Vector3d::UnitX()))
      .toRotationMatrix();
}

/// The number itself; null for rotations, which are not kept as angles.
template <typename Spec>
auto FindNumber(Spec& spec, const Parameter& p) -> decltype(&spec.base.wheel_radius) {
  const auto joint = [&]() -> auto& { return spec.joints[static_cast<size_t>(p.index)]; };
  const auto body = [&]() -> auto& { return p.index < 0 ? spec.base.body : joint().body; };
  const auto frame = [&]() -> auto& { return spec.frames[static_cast<size_t>(p.index)]; };
  switch (p.kind) {
    case Kind::kAlpha:
      return &joint().mdh.alpha;
    case Kind::kA:
      return &joint().mdh.a;
    case Kind::kHomeAngle:
      return &joint().mdh.q;
    case Kind::kD:
      return &joint().mdh.d;
    case Kind::kPosition:
      return joint().X_PB.matrix().col(3).data() + p.component;
    case Kind::kDamping:
      return &joint().damping;
    case Kind::kArmature:
      return &joint().armature;
    case Kind::kDryFriction:
      return &joint().dry_friction;
    case Kind::kLowerLimit:
      return &joint().lower;
    case Kind::kUpperLimit:
      return &joint().upper;
    case Kind::kMass:
      return &body().mass;
    case Kind::kCom:
      return body().com.data() + p.component;
    case Kind::kInertia:
      return body().inertia.data() + EntryOf(p);
    case Kind::kFramePosition:
      return frame().X_LF.matrix().col(3).data() + p.component;
    case Kind::kSphereRadius:
      return &*frame().sphere_radius;
    case Kind::kBasePosition:
      return spec.base.X_B0.matrix().col(3).data() + p.component;
    case Kind::kWheelRadius:
      return &spec.base.wheel_radius;
    case Kind::kWheelDistance:
      return &spec.base.wheel_distance;
    case Kind::kWheelMass:
      return &spec.base.wheel.mass;
    case Kind::kWheelSpinInertia:
      return &spec.base.wheel.spin_inertia;
    case Kind::kWheelTransverseInertia:
      return &spec.base.wheel.transverse_inertia;
    case Kind::kWheelArmature:
      return &spec.base.wheel.armature;
    case Kind::kWheelDamping:
      return &spec.base.wheel.damping;
    case Kind::kGravity:
      return spec.gravity.data() + p.component;
    case Kind::kObjectMass:
      return &spec.object->body.mass;
    case Kind::kObjectInertia:
      return spec.object->body.inertia.data() + EntryOf(p);
    case Kind::kObjectFriction:
      return &spec.object->friction;
    case Kind::kObjectRingRadius:
      return &std::get<SolidTorus>(spec.object->shape).ring_radius;
    case Kind::kObjectTubeRadius:
      return &std::get<SolidTorus>(spec.object->shape).tube_radius;
    case Kind::kRotation:
    case Kind::kFrameRotation:
    case Kind::kBaseRotation:
      break;
  }
  return nullptr;
}

template <typename Spec>
auto& RotationOf(Spec& spec, const Parameter& p) {
  if (p.kind == Kind::kBaseRotation) return spec.base.X_B0;
  if (p.kind == Kind::kFrameRotation) return spec.frames[static_cast<size_t>(p.index)].X_LF;
  return spec.joints[static_cast<size_t>(p.index)].X_PB;
}

}  // namespace

std::vector<Parameter> ListParameters(const RobotSpec& spec) {
  std::vector<Parameter> all;
  const auto add = [&](Kind kind, int index, int components = 1) {
    for (int k = 0; k < components; ++k) all.push_back({kind, index, k});
  };
  for (int i = 0; i < static_cast<int>(spec.joints.size()); ++i) {
    for (const Kind kind : {Kind::kAlpha, Kind::kA, Kind::kHomeAngle, Kind::kD}) add(kind, i);
    add(Kind::kPosition, i, 3);
    add(Kind::kRotation, i, 3);
    if (spec.joints[static_cast<size_t>(i)].dry_friction > 0.0) add(Kind::kDryFriction, i);
    for (const Kind kind :
         {Kind::kDamping, Kind::kArmature, Kind::kLowerLimit, Kind::kUpperLimit, Kind::kMass})
      add(kind, i);
    add(Kind::kCom, i, 3);
    add(Kind::kInertia, i, 6);
  }
  for (int i = 0; i < static_cast<int>(spec.frames.size()); ++i) {
    add(Kind::kFramePosition, i, 3);
    add(Kind::kFrameRotation, i, 3);
    if (spec.frames[static_cast<size_t>(i)].sphere_radius) add(Kind::kSphereRadius, i);
  }
  if (spec.base.type != BaseType::kFloating) add(Kind::kBasePosition, -1, 3);
  if (spec.base.type == BaseType::kFixed) {
    add(Kind::kBaseRotation, -1, 3);
  } else {
    add(Kind::kMass, -1);
    add(Kind::kCom, -1, 3);
    add(Kind::kInertia, -1, 6);
  }
  if (spec.base.type == BaseType::kDifferentialDrive) {
    for (const Kind kind :
         {Kind::kWheelRadius, Kind::kWheelDistance, Kind::kWheelMass, Kind::kWheelSpinInertia,
          Kind::kWheelTransverseInertia, Kind::kWheelArmature, Kind::kWheelDamping})
      add(kind, -1);
  }
  add(Kind::kGravity, -1, 3);
  if (spec.object) {
    add(Kind::kObjectMass, -1);
    add(Kind::kObjectInertia, -1, 6);
    add(Kind::kObjectFriction, -1);
    if (std::holds_alternative<SolidTorus>(spec.object->shape)) {
      add(Kind::kObjectRingRadius, -1);
      add(Kind::kObjectTubeRadius, -1);
    }
  }
  return all;
}

double GetValue(const RobotSpec& spec, const Parameter& parameter) {
  if (const double* number = FindNumber(spec, parameter)) return *number;
  return ToRpy(RotationOf(spec, parameter).linear())[parameter.component];
}

void SetValue(RobotSpec* spec, const Parameter& parameter, double value) {
  if (double* number = FindNumber(*spec, parameter)) {
    *number = value;
    if (IsTensor(parameter)) number[MirrorEntryOf(parameter) - EntryOf(parameter)] = value;
    return;
  }
  Pose& X = RotationOf(*spec, parameter);
  Vector3d rpy = ToRpy(X.linear());
  rpy[parameter.component] = value;
  X.linear() = FromRpy(rpy);
}

Joint& JointOf(RobotSpec* spec, int joint) { return spec->joints[static_cast<size_t>(joint)]; }

std::optional<RobotModel> TryModel(const RobotSpec& spec) {
  try {
    return RobotModel(spec);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

bool IsAngle(const RobotSpec& spec, const Parameter& parameter) {
  switch (parameter.kind) {
    case Kind::kAlpha:
    case Kind::kHomeAngle:
    case Kind::kRotation:
    case Kind::kFrameRotation:
    case Kind::kBaseRotation:
      return true;
    case Kind::kLowerLimit:
    case Kind::kUpperLimit:
      return spec.joints[static_cast<size_t>(parameter.index)].type == JointType::kRevolute;
    default:
      return false;
  }
}

bool IsGeometric(ParameterKind kind) {
  switch (kind) {
    case Kind::kAlpha:
    case Kind::kA:
    case Kind::kHomeAngle:
    case Kind::kD:
    case Kind::kPosition:
    case Kind::kRotation:
    case Kind::kFramePosition:
    case Kind::kFrameRotation:
    case Kind::kBasePosition:
    case Kind::kBaseRotation:
      return true;
    default:
      return false;
  }
}

bool IsDynamic(ParameterKind kind) {
  switch (kind) {
    case Kind::kMass:
    case Kind::kCom:
    case Kind::kInertia:
    case Kind::kDamping:
    case Kind::kArmature:
    case Kind::kGravity:
    case Kind::kWheelMass:
    case Kind::kWheelSpinInertia:
    case Kind::kWheelTransverseInertia:
    case Kind::kWheelArmature:
    case Kind::kWheelDamping:
      return true;
    default:
      return false;
  }
}

double GetScale(const RobotSpec& spec, const Parameter& p) {
  const double size = std::abs(GetValue(spec, p));
  if (IsTensor(p)) {
    const Matrix3d& tensor = p.kind == Kind::kObjectInertia ? spec.object->body.inertia
                             : p.index < 0                  ? spec.base.body.inertia
                                           : spec.joints[static_cast<size_t>(p.index)].body.inertia;
    return size > 0.0 ? size : tensor.trace() > 0.0 ? tensor.trace() : 1.0;
  }
  if (size > 0.0) return size;
  constexpr double kArm = 1.0;  // m; so that 0.1 % of it is a millimetre
  if (p.kind == Kind::kGravity) return spec.gravity.norm() > 0.0 ? spec.gravity.norm() : 1.0;
  return kArm;
}

std::string DescribePart(const RobotSpec& spec, const Parameter& p) {
  switch (p.kind) {
    case Kind::kMass:
    case Kind::kCom:
    case Kind::kInertia:
      return "link " + (p.index < 0 ? spec.base.link : spec.joints[static_cast<size_t>(p.index)].link);
    case Kind::kFramePosition:
    case Kind::kFrameRotation:
    case Kind::kSphereRadius:
      return "frame " + spec.frames[static_cast<size_t>(p.index)].name;
    case Kind::kGravity:
      return "gravity";
    case Kind::kObjectMass:
    case Kind::kObjectInertia:
    case Kind::kObjectFriction:
    case Kind::kObjectRingRadius:
    case Kind::kObjectTubeRadius:
      return "object " + spec.object->name;
    default:
      return p.index < 0 ? "base " + spec.base.link
                         : "joint " + spec.joints[static_cast<size_t>(p.index)].name;
  }
}

std::string DescribeGroup(const Parameter& parameter) { return TextOf(parameter).name; }

std::string DescribeQuantity(const Parameter& p) {
  static constexpr const char* kAxes[] = {" x", " y", " z"};
  static constexpr const char* kTurns[] = {"roll", "pitch", "yaw"};
  static constexpr const char* kEntries[] = {"Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"};
  switch (p.kind) {
    case Kind::kPosition:
    case Kind::kFramePosition:
    case Kind::kBasePosition:
    case Kind::kCom:
    case Kind::kGravity:
      return DescribeGroup(p) + kAxes[p.component];
    case Kind::kRotation:
    case Kind::kFrameRotation:
    case Kind::kBaseRotation:
      return kTurns[p.component];
    case Kind::kInertia:
    case Kind::kObjectInertia:
      return kEntries[p.component];
    default:
      return DescribeGroup(p);
  }
}

std::string UnitOf(const RobotSpec& spec, const Parameter& parameter) {
  if (IsAngle(spec, parameter)) return "deg";
  const Kind kind = parameter.kind;
  const bool of_joint = kind == Kind::kDamping || kind == Kind::kArmature || kind == Kind::kDryFriction;
  if (of_joint && spec.joints[static_cast<size_t>(parameter.index)].type == JointType::kPrismatic)
    return kind == Kind::kDamping ? "N s/m" : kind == Kind::kArmature ? "kg" : "N";
  return TextOf(parameter).unit;
}

double ToPrinted(const RobotSpec& spec, const Parameter& parameter, double value) {
  return IsAngle(spec, parameter) ? RadToDeg(value) : value;
}

RobotModel ChangeNumber(RobotSpec spec, const Parameter& number, double scale) {
  const double value = GetValue(spec, number);
  const double change = scale * GetScale(spec, number);
  SetValue(&spec, number, value + change);
  try {
    return RobotModel(spec);
  } catch (const InputError&) {
    SetValue(&spec, number, value - change);
    return RobotModel(spec);
  }
}

}  // namespace dexcheck
