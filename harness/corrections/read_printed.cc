#include "harness/corrections/read_printed.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "controller/common/text.h"
#include "controller/model/rigid_body.h"
#include "harness/descriptions/urdf_file.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

using Element = tinyxml2::XMLElement;

std::optional<PrintedScalar> ReadUrdfScalar(const Element* element, const char* attribute) {
  if (element == nullptr || element->Attribute(attribute) == nullptr) return std::nullopt;
  return ReadPrintedScalar(element->Attribute(attribute));
}

PrintedOrigin ReadUrdfOrigin(const Element* element) {
  PrintedOrigin origin;
  const Element* const child = element == nullptr ? nullptr : element->FirstChildElement("origin");
  origin.form = RotationForm::kRollPitchYaw;
  if (child == nullptr) return origin;
  std::tie(origin.t, origin.half_t) = ReadPrintedVector<3>(ReadAttribute(*child, "xyz"));
  const auto [angles, halves] = ReadPrintedVector<3>(ReadAttribute(*child, "rpy"));
  origin.r.head<3>() = angles;
  origin.half_r.head<3>() = halves;
  return origin;
}

std::optional<PrintedInertial> ReadUrdfInertial(const Element& link) {
  const Element* const element = link.FirstChildElement("inertial");
  if (element == nullptr) return std::nullopt;
  const std::optional<PrintedScalar> mass = ReadUrdfScalar(element->FirstChildElement("mass"), "value");
  if (!mass) return std::nullopt;
  PrintedInertial inertial;
  inertial.mass = *mass;
  inertial.origin = ReadUrdfOrigin(element);
  constexpr const char* kEntries[] = {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"};
  for (int k = 0; k < 6; ++k) {
    const PrintedScalar entry =
        ReadUrdfScalar(element->FirstChildElement("inertia"), kEntries[k]).value_or(PrintedScalar{});
    inertial.I[k] = entry.value;
    inertial.half_I[k] = entry.half;
  }
  return inertial;
}

JointKind FindUrdfKind(const std::string& type) {
  if (type == "fixed") return JointKind::kFixed;
  if (type == "prismatic") return JointKind::kSlide;
  if (type == "floating" || type == "planar") return JointKind::kFree;
  return JointKind::kHinge;
}

PrintedJoint ReadUrdfJoint(const UrdfJoint& joint) {
  PrintedJoint printed;
  printed.name = joint.name;
  printed.kind = FindUrdfKind(joint.type);
  printed.axis = Vector3d::UnitX();
  const Element* const axis = joint.element->FirstChildElement("axis");
  printed.states_axis = axis != nullptr;
  if (axis != nullptr)
    std::tie(printed.axis, printed.half_axis) = ReadPrintedVector<3>(ReadAttribute(*axis, "xyz", "1 0 0"));
  const Element* const limit = joint.element->FirstChildElement("limit");
  const Element* const dynamics = joint.element->FirstChildElement("dynamics");
  if (limit != nullptr && joint.type != "continuous")
    printed.range = {ReadUrdfScalar(limit, "lower").value_or(PrintedScalar{}),
                     ReadUrdfScalar(limit, "upper").value_or(PrintedScalar{})};
  const auto take = [&](JointScalar scalar, const Element* element, const char* attribute) {
    printed.scalars[static_cast<size_t>(scalar)] = ReadUrdfScalar(element, attribute);
  };
  take(JointScalar::kDamping, dynamics, "damping");
  take(JointScalar::kFriction, dynamics, "friction");
  take(JointScalar::kEffort, limit, "effort");
  take(JointScalar::kVelocity, limit, "velocity");
  if (const Element* const mimic = joint.element->FirstChildElement("mimic")) {
    PrintedMimic& follows = printed.mimic.emplace();
    follows.leader = ReadAttribute(*mimic, "joint");
    follows.multiplier = ReadUrdfScalar(mimic, "multiplier").value_or(PrintedScalar{1.0, 0.0});
    follows.offset = ReadUrdfScalar(mimic, "offset").value_or(PrintedScalar{});
  }
  return printed;
}

/// Gives joints the reductions of their transmissions.
void ReadTransmissions(const Element& root, PrintedRobot* robot) {
  for (const Element* const transmission : ListChildren(&root, "transmission")) {
    std::string joint;
    std::optional<PrintedScalar> reduction;
    VisitElements(transmission, [&](const Element* element) {
      const std::string_view name = element->Name();
      if (name == "joint") joint = ReadAttribute(*element, "name");
      if (name == "mechanicalReduction" && element->GetText() != nullptr)
        reduction = ReadPrintedScalar(element->GetText());
    });
    const auto moved =
        std::ranges::find_if(robot->links, [&](const PrintedLink& link) { return link.joint.name == joint; });
    if (!reduction || moved == robot->links.end()) continue;
    robot->has_motors = true;
    moved->joint.scalars[static_cast<size_t>(JointScalar::kGear)] = reduction;
  }
}

/// Half a unit of the last digit that a table needs for a number.
PrintedScalar PrintShortest(double value) {
  constexpr int kDigits = 12;
  const std::optional<PrintedNumber> printed = ReadPrinted(FormatNumber(value, kDigits));
  return printed ? PrintedScalar{value, printed->half_unit} : PrintedScalar{value, 0.0};
}

template <int N>
Eigen::Matrix<double, N, 1> FindHalves(const Eigen::Matrix<double, N, 1>& values) {
  return values.unaryExpr([](double value) { return PrintShortest(value).half; });
}

PrintedScalar PrintAngle(double angle) { return {angle, DegToRad(PrintShortest(RadToDeg(angle)).half)}; }

/// Roll, pitch and yaw as they may be printed: of the two solutions the one of fewer digits.
PrintedOrigin PrintPose(const Pose& X) {
  PrintedOrigin origin;
  origin.form = RotationForm::kRollPitchYaw;
  origin.t = X.translation();
  origin.half_t = FindHalves<3>(origin.t);
  if (X.linear().isIdentity(0.0)) return origin;
  for (const Vector3d& angles : SolveRollPitchYaw(X.linear())) {
    const Vector3d rpy = angles.unaryExpr([](double angle) { return std::remainder(angle, 2.0 * kPi); });
    const Vector3d halves = FindHalves<3>(rpy);
    if (origin.half_r.sum() > 0.0 && halves.sum() <= origin.half_r.sum()) continue;
    origin.r.head<3>() = rpy;
    origin.half_r.head<3>() = halves;
  }
  return origin;
}

PrintedOrigin PrintRow(const Joint& joint, const WrittenRow& row, const Pose& X_jP) {
  PrintedOrigin origin;
  if (row.is_plain) {
    origin = PrintPose(X_jP.inverse() * CalcRowPose(joint) * row.X_iL);
    if (!TurnRollPitchYaw(row.rpy).isApprox(origin.CalcRotation(), 1e-9)) return origin;
    origin.r.head<3>() = row.rpy;
    origin.half_r.head<3>() = FindHalves<3>(row.rpy);
    return origin;
  }
  origin.form = RotationForm::kMdh;
  origin.X_before = X_jP.inverse() * joint.X_PB;
  origin.r.head<2>() << joint.mdh.alpha, joint.mdh.q;
  origin.half_r.head<2>() << PrintAngle(joint.mdh.alpha).half, PrintAngle(joint.mdh.q).half;
  origin.t << joint.mdh.a, 0.0, joint.mdh.d;
  origin.half_t = FindHalves<3>(origin.t);
  return origin;
}

PrintedInertial PrintBody(const MassProperties& body) {
  PrintedInertial inertial;
  inertial.mass = PrintShortest(body.mass);
  inertial.origin.form = RotationForm::kRollPitchYaw;
  inertial.origin.t = body.com;
  inertial.origin.half_t = FindHalves<3>(body.com);
  inertial.I = ToEntries(body.inertia);
  inertial.half_I = FindHalves<6>(inertial.I);
  return inertial;
}

PrintedJoint PrintJoint(const Joint& joint, const DescribedJoint& stated, const std::vector<Joint>& all) {
  PrintedJoint printed;
  printed.name = joint.name;
  printed.kind = joint.type == JointType::kRevolute    ? JointKind::kHinge
                 : joint.type == JointType::kPrismatic ? JointKind::kSlide
                                                       : JointKind::kBall;
  constexpr double kReadAxis = 1e-6;  // the reader turns rows to it
  printed.axis = stated.X_iL.linear().row(2).transpose();
  if (stated.is_plain) printed.half_axis.setConstant(kReadAxis);
  printed.anchor = stated.X_iL.inverse().translation();
  if (stated.states_range && printed.kind != JointKind::kBall)
    printed.range = {PrintShortest(joint.lower), PrintShortest(joint.upper)};
  const auto take = [&](JointScalar scalar, bool states, double value) {
    if (states) printed.scalars[static_cast<size_t>(scalar)] = PrintShortest(value);
  };
  take(JointScalar::kDamping, stated.states_damping, joint.damping);
  take(JointScalar::kFriction, stated.states_dry_friction, joint.dry_friction);
  take(JointScalar::kArmature, stated.states_armature, joint.armature);
  take(JointScalar::kGear, !joint.coupling, 1.0);  // torques are controls
  if (joint.coupling)
    printed.mimic = {all[static_cast<size_t>(joint.coupling->leader)].name,
                     PrintShortest(joint.coupling->multiplier), PrintShortest(joint.coupling->offset)};
  return printed;
}

}  // namespace

std::optional<PrintedNumber> ReadPrinted(std::string_view text) {
  constexpr int kFewestDigits = 3;
  constexpr int kFewestDecimals = 4;  // of a whole number that a program printed
  if (text.starts_with('+')) text.remove_prefix(1);
  PrintedNumber number;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number.value);
  if (error != std::errc() || stop != end || !std::isfinite(number.value)) return std::nullopt;
  const size_t exponent = std::min(text.find_first_of("eE"), text.size());
  const std::string_view mantissa = text.substr(0, exponent);
  const size_t point = std::min(mantissa.find('.'), mantissa.size());
  int power = 0;
  if (exponent < text.size()) {
    std::string_view rest = text.substr(exponent + 1);
    if (rest.starts_with('+')) rest.remove_prefix(1);
    std::from_chars(rest.data(), end, power);
  }
  int decimals = -power;
  for (size_t i = 0; i < mantissa.size(); ++i) {
    if (std::isdigit(static_cast<unsigned char>(mantissa[i])) == 0) continue;
    if (i > point) ++decimals;
    if (number.digits > 0 || mantissa[i] != '0') ++number.digits;
  }
  if (number.value == std::floor(number.value) && decimals < kFewestDecimals) return number;
  // A zero has no significant digit, and is known to its last decimal.
  if (number.value != 0.0) decimals += std::max(kFewestDigits - number.digits, 0);
  number.half_unit = 0.5 * std::pow(10.0, -decimals);
  return number;
}

std::optional<PrintedScalar> ReadPrintedScalar(std::string_view text) {
  const std::optional<PrintedNumber> number = ReadPrinted(Trim(text));
  if (!number) return std::nullopt;
  PrintedScalar scalar{number->value, number->half_unit};
  // A whole number is exact, unless it is written as a power of ten: 8.542e+06.
  if (scalar.half == 0.0 && scalar.value != 0.0 && text.find_first_of("eE") != std::string_view::npos)
    scalar.half = 0.5 * std::pow(10.0, std::floor(std::log10(std::abs(scalar.value))) + 1.0 -
                                           std::max(number->digits, 3));
  return scalar;
}

template <int N>
std::pair<Eigen::Matrix<double, N, 1>, Eigen::Matrix<double, N, 1>> ReadPrintedVector(std::string_view text) {
  std::pair<Eigen::Matrix<double, N, 1>, Eigen::Matrix<double, N, 1>> numbers;
  numbers.first.setZero();
  numbers.second.setZero();
  constexpr std::string_view kBlanks = " \t\r\n,";
  for (int k = 0; k < N; ++k) {
    const size_t begin = std::min(text.find_first_not_of(kBlanks), text.size());
    text.remove_prefix(begin);
    const size_t end = std::min(text.find_first_of(kBlanks), text.size());
    if (const std::optional<PrintedScalar> number = ReadPrintedScalar(text.substr(0, end))) {
      numbers.first[k] = number->value;
      numbers.second[k] = number->half;
    }
    text.remove_prefix(end);
  }
  return numbers;
}

template std::pair<Vector3d, Vector3d> ReadPrintedVector<3>(std::string_view);
template std::pair<Vector4d, Vector4d> ReadPrintedVector<4>(std::string_view);
template std::pair<Vector6d, Vector6d> ReadPrintedVector<6>(std::string_view);

PrintedRobot ReadPrintedUrdf(const std::string& text, const std::string& source) {
  const UrdfFile file(text, source);
  PrintedRobot robot;
  robot.source = source;
  robot.format = RobotFormat::kUrdf;
  std::vector<std::pair<int, int>> open = {{file.root(), -1}};  // link of the file, parent here
  while (!open.empty()) {
    const auto [index, parent] = open.back();
    open.pop_back();
    const UrdfLink& link = file.link(index);
    PrintedLink printed;
    printed.name = link.name;
    printed.parent = parent;
    printed.inertial = ReadUrdfInertial(*link.element);
    if (link.parent_joint >= 0) {
      const UrdfJoint& joint = file.joint(link.parent_joint);
      printed.joint = ReadUrdfJoint(joint);
      printed.origin = ReadUrdfOrigin(joint.element);
    }
    const int added = robot.Add(std::move(printed));
    for (auto child = link.child_joints.rbegin(); child != link.child_joints.rend(); ++child)
      open.emplace_back(file.joint(*child).child, added);
  }
  ReadTransmissions(*file.link(file.root()).element->Parent()->ToElement(), &robot);
  return robot;
}

PrintedRobot PrintDescription(const RobotDescription& description) {
  const RobotSpec& spec = description.spec;
  PrintedRobot robot;
  robot.source = spec.source;
  robot.format = description.format;
  if (description.states_gravity) robot.gravity = spec.gravity;
  const bool is_fixed = spec.base.type == BaseType::kFixed;
  if (description.states_base && (is_fixed || spec.base.type == BaseType::kFloating))
    robot.floats = !is_fixed;
  PrintedLink base;
  base.name = spec.base.link;
  base.origin = PrintPose(spec.base.X_B0);
  if (spec.base.type != BaseType::kFixed) base.inertial = PrintBody(spec.base.body);
  robot.Add(std::move(base));
  for (size_t i = 0; i < spec.joints.size(); ++i) {
    const Joint& joint = spec.joints[i];
    const DescribedJoint& stated = description.joints[i];
    Pose X_jP = Pose::Identity();
    if (joint.parent >= 0) X_jP = description.joints[static_cast<size_t>(joint.parent)].X_iL;
    PrintedLink link;
    link.name = joint.link;
    link.parent = joint.parent + 1;
    link.joint = PrintJoint(joint, stated, spec.joints);
    link.origin = PrintRow(joint, stated, X_jP);
    if (link.origin.form == RotationForm::kMdh && !stated.X_iL.isApprox(Pose::Identity())) {
      PrintedOrigin& modified = link.as_modified.emplace(link.origin);
      const Matrix3d R = stated.X_iL.linear();
      modified.r[0] = std::atan2(R(2, 1), R(2, 2));
      modified.t.x() = stated.X_iL.translation().x();
      modified.half_r[0] = PrintAngle(modified.r[0]).half;
      modified.half_t = FindHalves<3>(modified.t);
      const Pose X = link.origin.CalcPose() * stated.X_iL;
      link.origin.t = X.translation();
      link.origin.form = RotationForm::kQuaternion;
      link.origin.SetRotation(X.linear());
    }
    link.inertial = PrintBody(ExpressIn(joint.body, stated.X_iL.inverse()));
    robot.Add(std::move(link));
  }
  if (spec.base.type == BaseType::kDifferentialDrive) {
    const Base& drive = spec.base;
    for (const bool left : {true, false}) {
      PrintedLink wheel;
      wheel.joint.name = wheel.name = left ? drive.wheel_joint_left : drive.wheel_joint_right;
      wheel.parent = 0;
      wheel.joint.kind = JointKind::kHinge;
      wheel.joint.axis = Vector3d::UnitY();
      wheel.origin =
          PrintPose(Pose(Eigen::Translation3d(0.0, (left ? 0.5 : -0.5) * drive.wheel_distance, 0.0)));
      wheel.joint.scalars[static_cast<size_t>(JointScalar::kDamping)] = PrintShortest(drive.wheel.damping);
      wheel.joint.scalars[static_cast<size_t>(JointScalar::kArmature)] = PrintShortest(drive.wheel.armature);
      wheel.inertial = PrintBody({drive.wheel.mass, Vector3d::Zero(),
                                  Matrix3d(Vector3d(drive.wheel.transverse_inertia, drive.wheel.spin_inertia,
                                                    drive.wheel.transverse_inertia)
                                               .asDiagonal())});
      robot.Add(std::move(wheel));
    }
  }
  for (const Frame& frame : spec.frames) {
    PrintedLink link;
    link.name = frame.name;
    link.parent = frame.link + 1;
    link.is_frame = true;
    const Pose X_iL =
        frame.link < 0 ? Pose::Identity() : description.joints[static_cast<size_t>(frame.link)].X_iL;
    link.origin = PrintPose(X_iL.inverse() * frame.X_LF);
    if (!Contains(robot.links, frame.name, &PrintedLink::name)) robot.Add(std::move(link));
  }
  return robot;
}

PrintedRobot ReadPrintedRobot(const DescriptionFile& file, const DescriptionFile* carrier) {
  PrintedRobot robot;
  if (file.format() == RobotFormat::kUrdf) {
    robot = ReadPrintedUrdf(file.text(), file.path().string());
  } else if (file.format() == RobotFormat::kMjcf) {
    robot = ReadPrintedMjcf(file.document(), *file.CopyEngine());
    for (const std::string& force : file.newer_forces())
      robot.constraints.push_back(fmt::format("{} {}", kServo, force));
    std::ranges::sort(robot.constraints);
  } else if (file.format() == RobotFormat::kBodies && carrier != nullptr &&
             carrier->format() != RobotFormat::kBodies) {
    robot = ReadPrintedRobot(*carrier);
    for (const TabledBody& row : ReadBodyTable(file.text(), file.path().string())) {
      PrintedLink* const link = FindIn(robot.links, row.link, &PrintedLink::name);
      if (link != nullptr) link->inertial = PrintBody(row.body);
    }
  } else {
    robot = PrintDescription(file.Describe());
  }
  robot.source = file.path().filename().string();
  LevelPrecision(&robot);
  return robot;
}

}  // namespace dexcheck
