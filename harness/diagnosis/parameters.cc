#include "harness/diagnosis/parameters.h"

#include <cmath>
#include <iterator>

#include "controller/common/errors.h"

namespace dexcheck {
namespace {

using Kind = ParameterKind;

/// The place of a number in a specification, or of the first of a vector, tensor or pose.
struct NumberPlace {
  template <typename Place>
  constexpr NumberPlace(Place place) : read(place), write(place) {}
  const double* (*read)(const RobotSpec& spec, int index);
  double* (*write)(RobotSpec& spec, int index);
};

template <typename Spec>
auto& JointAt(Spec& spec, int index) {
  return spec.joints[static_cast<size_t>(index)];
}
template <typename Spec>
auto& BodyAt(Spec& spec, int link) {
  return link < 0 ? spec.base.body : JointAt(spec, link).body;
}
template <typename Spec>
auto& FrameAt(Spec& spec, int index) {
  return spec.frames[static_cast<size_t>(index)];
}
template <typename Spec>
auto& TorusOf(Spec& spec) {
  return std::get<SolidTorus>(spec.object->shape);
}

struct ParameterTable {
  enum Part { kJoint, kLink, kFrame, kBase, kWheels, kRobot, kObject };  ///< What a number belongs to.
  enum Form { kNumber, kAngle, kVector, kPosition, kRotation, kTensor };
  struct Entry {
    const char* name;
    Part part;
    Form form;
    NumberPlace place;
    std::optional<SiteKind> site = std::nullopt;
  };
  static const Entry kEntries[32];
};

/// In the order of the enumeration.
constexpr ParameterTable::Entry ParameterTable::kEntries[] = {
    {"alpha", kJoint, kAngle, [](auto& s, int i) { return &JointAt(s, i).mdh.alpha; }, SiteKind::kRotation},
    {"a", kJoint, kNumber, [](auto& s, int i) { return &JointAt(s, i).mdh.a; }, SiteKind::kPosition},
    {"q (home angle)", kJoint, kAngle, [](auto& s, int i) { return &JointAt(s, i).mdh.q; },
     SiteKind::kRotation},
    {"d", kJoint, kNumber, [](auto& s, int i) { return &JointAt(s, i).mdh.d; }, SiteKind::kPosition},
    {"position", kJoint, kPosition, [](auto& s, int i) { return JointAt(s, i).X_PB.data(); },
     SiteKind::kPosition},
    {"rotation", kJoint, kRotation, [](auto& s, int i) { return JointAt(s, i).X_PB.data(); },
     SiteKind::kRotation},
    {"dry friction", kJoint, kNumber, [](auto& s, int i) { return &JointAt(s, i).dry_friction; },
     SiteKind::kFriction},
    {"damping", kJoint, kNumber, [](auto& s, int i) { return &JointAt(s, i).damping; }, SiteKind::kDamping},
    {"armature", kJoint, kNumber, [](auto& s, int i) { return &JointAt(s, i).armature; },
     SiteKind::kArmature},
    {"lower limit", kJoint, kNumber, [](auto& s, int i) { return &JointAt(s, i).lower; }, SiteKind::kRange},
    {"upper limit", kJoint, kNumber, [](auto& s, int i) { return &JointAt(s, i).upper; }, SiteKind::kRange},
    {"mass", kLink, kNumber, [](auto& s, int i) { return &BodyAt(s, i).mass; }, SiteKind::kMass},
    {"centre of mass", kLink, kVector, [](auto& s, int i) { return BodyAt(s, i).com.data(); },
     SiteKind::kCom},
    {"inertia", kLink, kTensor, [](auto& s, int i) { return BodyAt(s, i).inertia.data(); },
     SiteKind::kInertia},
    {"position", kFrame, kPosition, [](auto& s, int i) { return FrameAt(s, i).X_LF.data(); },
     SiteKind::kPosition},
    {"rotation", kFrame, kRotation, [](auto& s, int i) { return FrameAt(s, i).X_LF.data(); },
     SiteKind::kRotation},
    {"fingertip radius", kFrame, kNumber, [](auto& s, int i) { return &*FrameAt(s, i).sphere_radius; }},
    {"position", kBase, kPosition, [](auto& s, int) { return s.base.X_B0.data(); }, SiteKind::kPosition},
    {"rotation", kBase, kRotation, [](auto& s, int) { return s.base.X_B0.data(); }, SiteKind::kRotation},
    {"wheel radius", kWheels, kNumber, [](auto& s, int) { return &s.base.wheel_radius; }},
    {"wheel distance", kWheels, kNumber, [](auto& s, int) { return &s.base.wheel_distance; }},
    {"wheel mass", kWheels, kNumber, [](auto& s, int) { return &s.base.wheel.mass; }},
    {"wheel spin inertia", kWheels, kNumber, [](auto& s, int) { return &s.base.wheel.spin_inertia; }},
    {"wheel transverse inertia", kWheels, kNumber,
     [](auto& s, int) { return &s.base.wheel.transverse_inertia; }},
    {"wheel armature", kWheels, kNumber, [](auto& s, int) { return &s.base.wheel.armature; }},
    {"wheel damping", kWheels, kNumber, [](auto& s, int) { return &s.base.wheel.damping; }},
    {"gravity", kRobot, kVector, [](auto& s, int) { return s.gravity.data(); }, SiteKind::kGravity},
    {"mass", kObject, kNumber, [](auto& s, int) { return &s.object->body.mass; }},
    {"inertia", kObject, kTensor, [](auto& s, int) { return s.object->body.inertia.data(); }},
    {"friction", kObject, kNumber, [](auto& s, int) { return &s.object->friction; }},
    {"ring radius", kObject, kNumber, [](auto& s, int) { return &TorusOf(s).ring_radius; }},
    {"tube radius", kObject, kNumber, [](auto& s, int) { return &TorusOf(s).tube_radius; }},
};
static_assert(std::size(ParameterTable::kEntries) == static_cast<size_t>(Kind::kObjectTubeRadius) + 1);

const ParameterTable::Entry& EntryFor(Kind kind) {
  return ParameterTable::kEntries[static_cast<size_t>(kind)];
}

int CountComponents(Kind kind) {
  const ParameterTable::Form form = EntryFor(kind).form;
  return form == ParameterTable::kTensor ? 6 : form >= ParameterTable::kVector ? 3 : 1;
}

/// Returns the place of Ixx, Iyy, Izz, Ixy, Ixz, Iyz in a 3x3 matrix, of x, y, z in a vector or a 4x4 pose.
size_t OffsetOf(const Parameter& p) {
  static constexpr size_t kEntries[] = {0, 4, 8, 3, 6, 7};
  const auto k = static_cast<size_t>(p.component);
  const ParameterTable::Form form = EntryFor(p.kind).form;
  return form == ParameterTable::kTensor ? kEntries[k] : form == ParameterTable::kPosition ? 12 + k : k;
}

bool IsTensor(const Parameter& p) { return EntryFor(p.kind).form == ParameterTable::kTensor; }
/// Rotations are not kept as angles.
bool IsOfRotation(const Parameter& p) { return EntryFor(p.kind).form == ParameterTable::kRotation; }

/// Roll, pitch, yaw of R = Rot(z, yaw) Rot(y, pitch) Rot(x, roll).
Vector3d ToRpy(const Matrix3d& R) {
  const double pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  constexpr double kUpright = 1e-9;  // roll and yaw then turn about one axis: roll is taken as zero
  if (std::hypot(R(0, 0), R(1, 0)) < kUpright) return {0.0, pitch, std::atan2(-R(0, 1), R(1, 1))};
  return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
}

}  // namespace

std::vector<Parameter> ListParameters(const RobotSpec& spec) {
  std::vector<Parameter> all;
  const auto has = [&](Kind kind, int index) {
    if (kind == Kind::kDryFriction) return spec.joints[static_cast<size_t>(index)].dry_friction > 0.0;
    if (kind == Kind::kSphereRadius) return spec.frames[static_cast<size_t>(index)].sphere_radius.has_value();
    if (kind == Kind::kBasePosition) return spec.base.type != BaseType::kFloating;
    if (kind == Kind::kBaseRotation) return spec.base.type == BaseType::kFixed;
    if (kind >= Kind::kObjectRingRadius) return std::holds_alternative<SolidTorus>(spec.object->shape);
    return true;
  };
  const auto add = [&](ParameterTable::Part part, int index) {
    for (size_t i = 0; i < std::size(ParameterTable::kEntries); ++i) {
      const Kind kind{static_cast<int>(i)};
      if (EntryFor(kind).part != part || !has(kind, index)) continue;
      for (int k = 0; k < CountComponents(kind); ++k) all.push_back({kind, index, k});
    }
  };
  for (int i = 0; i < static_cast<int>(spec.joints.size()); ++i)
    for (const auto part : {ParameterTable::kJoint, ParameterTable::kLink}) add(part, i);
  for (int i = 0; i < static_cast<int>(spec.frames.size()); ++i) add(ParameterTable::kFrame, i);
  add(ParameterTable::kBase, -1);
  if (spec.base.type != BaseType::kFixed) add(ParameterTable::kLink, -1);
  if (spec.base.type == BaseType::kDifferentialDrive) add(ParameterTable::kWheels, -1);
  add(ParameterTable::kRobot, -1);
  if (spec.object) add(ParameterTable::kObject, -1);
  return all;
}

std::optional<SiteKind> FindSite(ParameterKind kind) { return EntryFor(kind).site; }

double GetValue(const RobotSpec& spec, const Parameter& parameter) {
  const double* const place = EntryFor(parameter.kind).place.read(spec, parameter.index);
  if (!IsOfRotation(parameter)) return place[OffsetOf(parameter)];
  return ToRpy(Eigen::Map<const Eigen::Matrix4d>(place).topLeftCorner<3, 3>())[parameter.component];
}

void SetValue(RobotSpec* spec, const Parameter& parameter, double value) {
  double* const place = EntryFor(parameter.kind).place.write(*spec, parameter.index);
  if (IsOfRotation(parameter)) {
    auto R = Eigen::Map<Eigen::Matrix4d>(place).topLeftCorner<3, 3>();
    Vector3d rpy = ToRpy(R);
    rpy[parameter.component] = value;
    R = TurnRollPitchYaw(rpy);
    return;
  }
  const size_t offset = OffsetOf(parameter);
  place[offset] = value;
  if (IsTensor(parameter)) place[offset / 3 + 3 * (offset % 3)] = value;
}

const MassProperties& BodyOf(const RobotSpec& spec, int link) { return BodyAt(spec, link); }
MassProperties& BodyOf(RobotSpec* spec, int link) { return BodyAt(*spec, link); }

std::optional<RobotModel> TryModel(const RobotSpec& spec) {
  try {
    return RobotModel(spec);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

double GetScale(const RobotSpec& spec, const Parameter& p) {
  const double size = std::abs(GetValue(spec, p));
  if (IsTensor(p)) {
    const Matrix3d& tensor =
        p.kind == Kind::kObjectInertia ? spec.object->body.inertia : BodyOf(spec, p.index).inertia;
    return size > 0.0 ? size : tensor.trace() > 0.0 ? tensor.trace() : 1.0;
  }
  if (size > 0.0) return size;
  constexpr double kArm = 1.0;  // m; so that 0.1 % of it is a millimetre
  if (p.kind == Kind::kGravity) return spec.gravity.norm() > 0.0 ? spec.gravity.norm() : 1.0;
  return kArm;
}

std::string DescribePart(const RobotSpec& spec, const Parameter& p) {
  switch (EntryFor(p.kind).part) {
    case ParameterTable::kLink:
      return "link " + (p.index < 0 ? spec.base.link : spec.joints[static_cast<size_t>(p.index)].link);
    case ParameterTable::kFrame:
      return "frame " + spec.frames[static_cast<size_t>(p.index)].name;
    case ParameterTable::kRobot:
      return "gravity";
    case ParameterTable::kObject:
      return "object " + spec.object->name;
    case ParameterTable::kJoint:
      return "joint " + spec.joints[static_cast<size_t>(p.index)].name;
    default:
      return "base " + spec.base.link;
  }
}

std::string DescribeGroup(const Parameter& parameter) { return EntryFor(parameter.kind).name; }

std::string DescribeQuantity(const Parameter& p) {
  static constexpr const char* kAxes[] = {" x", " y", " z"};
  static constexpr const char* kTurns[] = {"roll", "pitch", "yaw"};
  static constexpr const char* kEntries[] = {"Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"};
  switch (EntryFor(p.kind).form) {
    case ParameterTable::kVector:
    case ParameterTable::kPosition:
      return DescribeGroup(p) + kAxes[p.component];
    case ParameterTable::kRotation:
      return kTurns[p.component];
    case ParameterTable::kTensor:
      return kEntries[p.component];
    case ParameterTable::kNumber:
    case ParameterTable::kAngle:
      break;
  }
  return DescribeGroup(p);
}

std::optional<RobotModel> TryChange(const RobotSpec& spec, const Parameter& number, double* change) {
  for (int side = 0; side < 2; ++side) {
    RobotSpec changed = spec;
    SetValue(&changed, number, GetValue(spec, number) + *change);
    if (std::optional<RobotModel> model = TryModel(changed)) return model;
    *change = -*change;
  }
  return std::nullopt;
}

RobotModel ChangeNumber(RobotSpec spec, const Parameter& number, double scale) {
  double change = scale * GetScale(spec, number);
  if (const std::optional<RobotModel> changed = TryChange(spec, number, &change)) return *changed;
  SetValue(&spec, number, GetValue(spec, number) + change);
  return RobotModel(spec);
}

}  // namespace dexcheck
