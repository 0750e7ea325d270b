#include "harness/diagnosis/repair.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace dexcheck {
namespace {

constexpr int kManyDigits = 9;

// What both sides keep after some dozen rotations; what is printed must repair.
constexpr int kPrintedDigits = 13;

/// A mass, and with it the inertia: the only causes of several kinds.
bool IsBodyScaled(const Repair& cause) {
  return cause.parameters.size() > 1 && cause.parameters[0].kind == ParameterKind::kMass;
}

void TurnBody(const Matrix3d& R, MassProperties* body) {
  body->com = R * body->com;
  body->inertia = R * body->inertia * R.transpose();
}

/// "1.9", "-90"; rounding errors of a solved value are not printed.
std::string FormatEntry(const RobotSpec& spec, const Parameter& parameter, double value) {
  double printed = ToPrinted(spec, parameter, value);
  if (std::abs(value) < 1e-12 * GetScale(spec, parameter)) printed = 0.0;
  return fmt::format("{:.{}g}", printed, kPrintedDigits);
}

/// "1.9 kg", "-90 deg".
std::string FormatValue(const RobotSpec& spec, const Parameter& parameter, double value) {
  const std::string unit = UnitOf(spec, parameter);
  return FormatEntry(spec, parameter, value) + (unit.empty() ? "" : " ") + unit;
}

std::string FormatValues(const RobotSpec& spec, const std::vector<Parameter>& parameters,
                         const std::vector<double>& values) {
  if (parameters.size() == 1) return FormatValue(spec, parameters[0], values[0]);
  std::string text;
  for (size_t i = 0; i < parameters.size(); ++i) {
    // "x", behind "centre of mass" of the line.
    const std::string group = DescribeGroup(parameters[i]) + " ";
    std::string quantity = DescribeQuantity(parameters[i]);
    const bool is_said = i == 0 || parameters[i].kind == parameters[0].kind;
    if (is_said && quantity.starts_with(group)) quantity = quantity.substr(group.size());
    text += (i == 0 ? "" : ", ") + quantity + " " + FormatValue(spec, parameters[i], values[i]);
  }
  return text;
}

std::string DescribeWhat(const Repair& cause) {
  if (IsBodyScaled(cause)) return DescribeQuantity(cause.parameters[0]);
  return cause.parameters.size() == 1 ? DescribeQuantity(cause.parameters[0])
                                      : DescribeGroup(cause.parameters[0]);
}

}  // namespace

void ReverseAxis(RobotSpec* spec, int joint) {
  // With F a half turn about the row's x axis after Rot(x, alpha) and F^-1 F = 1 between joint and link:
  //   Rot(z, q0 - q) Trans(z, d) F = F Rot(z, -q0 + q) Trans(z, -d)
  const Matrix3d F = Vector3d(1.0, -1.0, -1.0).asDiagonal();
  Joint& turned = JointOf(spec, joint);
  turned.mdh.alpha += turned.mdh.alpha > 0.0 ? -kPi : kPi;
  turned.mdh.q = -turned.mdh.q;
  turned.mdh.d = -turned.mdh.d;
  TurnBody(F, &turned.body);
  const auto turn = [&](Pose* X) {
    X->linear() = F * X->linear();
    X->translation() = F * X->translation();
  };
  for (Joint& child : spec->joints) {
    if (child.parent == joint) turn(&child.X_PB);
  }
  for (Frame& frame : spec->frames) {
    if (frame.link == joint) turn(&frame.X_LF);
  }
}

std::vector<Repair> SplitByVector(const Repair& cause) {
  if (cause.kind != RepairKind::kParameters || cause.parameters.size() == 1) return {cause};
  std::vector<Repair> parts;
  for (size_t i = 0; i < cause.parameters.size(); ++i) {
    const Parameter& parameter = cause.parameters[i];
    auto same = std::find_if(parts.begin(), parts.end(),
                             [&](const Repair& part) { return part.parameters[0].IsBeside(parameter); });
    if (same == parts.end()) same = parts.insert(parts.end(), Repair{});
    same->Add(parameter, cause.values[i]);
  }
  return parts;
}

void MergeScaledBodies(const RobotSpec& spec, double same, std::vector<Repair>* causes) {
  for (size_t i = 0; i < causes->size(); ++i) {
    const Parameter mass = (*causes)[i].parameters[0];
    if (mass.kind != ParameterKind::kMass || !(GetValue(spec, mass) > 0.0)) continue;
    const auto inertia = std::find_if(causes->begin(), causes->end(), [&](const Repair& cause) {
      return cause.parameters[0].IsBeside({ParameterKind::kInertia, mass.index, 0});
    });
    if (inertia == causes->end()) continue;
    RobotSpec scaled = spec;
    Apply(*inertia, &scaled);
    const Matrix3d expected =
        (*causes)[i].values[0] / GetValue(spec, mass) * BodyOf(spec, mass.index).inertia;
    if ((BodyOf(scaled, mass.index).inertia - expected).norm() > same * expected.norm()) continue;
    Repair whole = (*causes)[i];
    for (size_t k = 0; k < inertia->parameters.size(); ++k)
      whole.Add(inertia->parameters[k], inertia->values[k]);
    (*causes)[i] = whole;
    if (static_cast<size_t>(inertia - causes->begin()) < i) --i;
    causes->erase(inertia);
  }
}

void Apply(const Repair& cause, RobotSpec* spec) {
  switch (cause.kind) {
    case RepairKind::kParameters:
      for (size_t i = 0; i < cause.parameters.size(); ++i)
        SetValue(spec, cause.parameters[i], cause.values[i]);
      return;
    case RepairKind::kAxisReversed:
      if (!cause.is_plain) return ReverseAxis(spec, cause.joint);
      JointOf(spec, cause.joint).mdh.alpha += JointOf(spec, cause.joint).mdh.alpha > 0.0 ? -kPi : kPi;
      return;
    case RepairKind::kAxisTurned:
      JointOf(spec, cause.joint).mdh.q = cause.values[0];
      JointOf(spec, cause.joint).mdh.alpha = cause.values[1];
      return;
    case RepairKind::kRowsSwapped:
      return std::swap(JointOf(spec, cause.joint).mdh, JointOf(spec, cause.other).mdh);
    case RepairKind::kPosesSwapped:
      return std::swap(JointOf(spec, cause.joint).X_PB, JointOf(spec, cause.other).X_PB);
    case RepairKind::kEngineOnly:
      return;
  }
}

std::string DescribeShort(const Repair& cause, const RobotSpec& spec) {
  if (cause.kind == RepairKind::kEngineOnly) return cause.note;
  if (cause.kind == RepairKind::kParameters)
    return DescribePart(spec, cause.parameters[0]) + ": " + DescribeWhat(cause);
  const auto name = [&](int joint) { return spec.joints[static_cast<size_t>(joint)].name; };
  if (cause.kind == RepairKind::kAxisReversed) return "joint " + name(cause.joint) + ": sign of the axis";
  if (cause.kind == RepairKind::kAxisTurned) return "joint " + name(cause.joint) + ": axis";
  return "joints " + name(cause.joint) + " and " + name(cause.other) +
         (cause.kind == RepairKind::kRowsSwapped ? ": rows exchanged" : ": places exchanged");
}

std::string Describe(const Repair& cause, const RobotSpec& spec, const std::string& file) {
  std::string what = DescribeShort(cause, spec);
  if (cause.kind == RepairKind::kEngineOnly) return what;
  if (cause.kind == RepairKind::kAxisReversed)
    return fmt::format("{}: turns the other way in {}; its axis reversed repairs it", what, file);
  if (cause.kind == RepairKind::kAxisTurned)
    return fmt::format("{} is another one than in {}; {} repairs it", what, file, cause.note);
  if (cause.kind != RepairKind::kParameters)
    return fmt::format("{} in {}; exchanging them repairs it", what, file);
  const std::vector<Parameter> numbers =
      IsBodyScaled(cause) ? std::vector<Parameter>{cause.parameters[0]} : cause.parameters;
  std::vector<double> found;
  found.reserve(numbers.size());
  for (const Parameter& parameter : numbers) found.push_back(GetValue(spec, parameter));
  return fmt::format("{} {} in {}, {} repairs it{}", what, FormatValues(spec, numbers, found), file,
                     FormatValues(spec, numbers, cause.values),
                     IsBodyScaled(cause) ? ", with the inertia in proportion" : "");
}

namespace {

// What solving leaves open, relative.
constexpr double kSolvedAccuracy = 1e-10;

/// The number with the fewest digits within an accuracy, and how many it has.
std::pair<double, int> Round(double number, double accuracy = kSolvedAccuracy) {
  for (int digits = 1; digits < kManyDigits; ++digits) {
    const double rounded = std::stod(fmt::format("{:.{}e}", number, digits - 1));
    if (std::abs(rounded - number) < accuracy * std::abs(number)) return {rounded, digits};
  }
  return {number, kManyDigits};
}

bool IsNothing(const RobotSpec& spec, const Parameter& parameter, double value,
               double accuracy = kSolvedAccuracy) {
  return std::abs(value) < 0.1 * accuracy * GetScale(spec, parameter);
}

}  // namespace

int CountDigits(const RobotSpec& spec, const Parameter& parameter, double value) {
  if (IsNothing(spec, parameter, value)) return 0;
  return std::min(Round(value).second, Round(ToPrinted(spec, parameter, value)).second);
}

double RoundSolved(const RobotSpec& spec, const Parameter& parameter, double value) {
  return RoundWithin(spec, parameter, value, kSolvedAccuracy);
}

double RoundWithin(const RobotSpec& spec, const Parameter& parameter, double value, double accuracy) {
  if (accuracy == 0.0) return value;
  if (IsNothing(spec, parameter, value, accuracy)) return 0.0;
  const auto [rounded, digits] = Round(value, accuracy);
  if (!IsAngle(spec, parameter)) return rounded;
  const auto [degrees, degree_digits] = Round(RadToDeg(value), accuracy);
  return degree_digits <= digits && degree_digits < kManyDigits ? DegToRad(degrees) : rounded;
}

double ReadBackPrinted(const RobotSpec& spec, const Parameter& parameter, double value) {
  const double printed = std::stod(FormatEntry(spec, parameter, value));
  return IsAngle(spec, parameter) ? DegToRad(printed) : printed;
}

bool LooksRounded(const Repair& cause, const RobotSpec& spec) {
  if (cause.kind != RepairKind::kParameters) return false;
  constexpr double kFourDigits = 1e-4;
  constexpr double kAngle = 1e-5;  // rad
  for (size_t i = 0; i < cause.parameters.size(); ++i) {
    const Parameter& parameter = cause.parameters[i];
    const double change = std::abs(cause.values[i] - GetValue(spec, parameter));
    if (IsAngle(spec, parameter)) {
      if (change > kAngle) return false;
      continue;
    }
    // Entries of a vector or tensor by the largest of it.
    double size = 0.0;
    const bool is_tensor = parameter.kind == ParameterKind::kInertia;
    const bool is_vector =
        parameter.kind == ParameterKind::kCom || parameter.kind == ParameterKind::kPosition;
    for (int k = 0; k < (is_tensor || is_vector ? 3 : 1); ++k) {
      const int component = is_tensor || is_vector ? k : parameter.component;
      size = std::max(size, std::abs(GetValue(spec, {parameter.kind, parameter.index, component})));
    }
    if (change > kFourDigits * size) return false;
  }
  return true;
}

bool IsLikelier(const Repair& a, const Repair& b, const RobotSpec& spec) {
  const auto rank = [&](const Repair& cause) {
    int digits = 0;
    int zeros = 0;
    int kind = -1;
    for (size_t i = 0; i < cause.parameters.size(); ++i) {
      digits += CountDigits(spec, cause.parameters[i], cause.values[i]);
      zeros += GetValue(spec, cause.parameters[i]) == 0.0 ? 1 : 0;
      kind = static_cast<int>(cause.parameters[i].kind);
    }
    return std::tuple(cause.parameters.size(), zeros, digits, kind);
  };
  return rank(a) < rank(b);
}

}  // namespace dexcheck
