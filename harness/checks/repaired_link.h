#pragma once

// A link as its file prints it and as it is repaired, for the formats that it is written in.

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <string>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/corrections/correction.h"
#include "harness/descriptions/read_description.h"

namespace dexcheck {

/// Twelve digits, which hide the rounding of what was computed.
inline std::string FormatRepaired(double value) {
  constexpr int kDigits = 12;
  constexpr double kRounding = 1e-15;
  return FormatNumber(std::abs(value) < kRounding ? 0.0 : value, kDigits);
}
template <typename Vector>
std::string JoinRepaired(const Vector& values, const char* between) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : between) + FormatRepaired(value);
  return text;
}

/// A link as it was and as it is repaired.
struct RepairedLink {
  const PrintedLink& before;
  const PrintedLink& after;

  [[nodiscard]] bool IsTurned() const { return IsTurned(before.origin, after.origin); }
  [[nodiscard]] bool IsMoved() const { return before.origin.t != after.origin.t; }
  [[nodiscard]] bool HasOtherBody() const {
    if (before.inertial.has_value() != after.inertial.has_value()) return true;
    return before.inertial && (before.inertial->mass.value != after.inertial->mass.value ||
                               before.inertial->origin.t != after.inertial->origin.t ||
                               before.inertial->I != after.inertial->I ||
                               IsTurned(before.inertial->origin, after.inertial->origin));
  }
  [[nodiscard]] bool HasOtherRange() const {
    const auto& x = before.joint.range;
    const auto& y = after.joint.range;
    return x.has_value() != y.has_value() ||
           (x && ((*x)[0].value != (*y)[0].value || (*x)[1].value != (*y)[1].value));
  }
  [[nodiscard]] bool HasOtherMimic() const {
    const auto& x = before.joint.mimic;
    const auto& y = after.joint.mimic;
    return x.has_value() != y.has_value() ||
           (x && (x->leader != y->leader || x->multiplier.value != y->multiplier.value ||
                  x->offset.value != y->offset.value));
  }
  /// The repaired number of a scalar that differs.
  [[nodiscard]] std::optional<double> FindScalar(size_t scalar) const {
    const auto& x = before.joint.scalars[scalar];
    const auto& y = after.joint.scalars[scalar];
    const double was = x ? x->value : 0.0, is = y ? y->value : 0.0;
    return was == is ? std::nullopt : std::optional(is);
  }
  /// The inertia along the link's axes: xx yy zz xy xz yz.
  [[nodiscard]] Vector6d CalcInertia() const {
    const Matrix3d R = after.inertial->origin.CalcRotation();
    return ToEntries(R * ToTensor(after.inertial->I) * R.transpose());
  }

 private:
  static bool IsTurned(const PrintedOrigin& x, const PrintedOrigin& y) {
    return x.r != y.r || x.form != y.form || x.sequence != y.sequence;
  }
};

class FileRepair {
 public:
  explicit FileRepair(const DescriptionFile& file) : file_(file.path().filename().string()) {}

 protected:
  [[noreturn]] void Refuse(const std::string& why) const {
    throw InputError(file_ + ": cannot be repaired: " + why);
  }
  void RefuseIf(bool is_changed, const PrintedLink& link, const char* what) const {
    if (is_changed) Refuse(fmt::format("joint {}: {} must be written by hand", link.joint.name, what));
  }

 private:
  std::string file_;
};

/// Scalars of joints in the order of JointScalar: the element below a URDF's joint and its attribute, and the
/// attribute of an MJCF's joint; none where the format has none.
struct ScalarAttribute {
  const char* urdf_element;
  const char* urdf;
  const char* mjcf;
  const char* toml;
};
inline constexpr ScalarAttribute kScalarAttributes[] = {
    {"dynamics", "damping", "damping", "damping"}, {"dynamics", "friction", "frictionloss", "dry_friction"},
    {nullptr, nullptr, "armature", "armature"},    {"limit", "effort", nullptr, nullptr},
    {"limit", "velocity", nullptr, nullptr},       {nullptr, nullptr, "stiffness", nullptr},
    {nullptr, nullptr, nullptr, nullptr},          {nullptr, nullptr, nullptr, nullptr}};
static_assert(std::size(kScalarAttributes) == kNumJointScalars);

/// Returns the text of a parameter file with the keys of a repaired robot.
/// @throws InputError as WriteRepaired.
std::string RepairTable(const DescriptionFile& file, const PrintedRobot& before, const PrintedRobot& after);

}  // namespace dexcheck
