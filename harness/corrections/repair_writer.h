#pragma once

// The part of writing a repaired file that all formats share.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/corrections/corrections.h"
#include "harness/corrections/printed_robot.h"
#include "harness/descriptions/read_description.h"

namespace dexcheck {

/// Prints ten digits, which hide the rounding of what was computed.
/// @param size the largest number of its vector.
inline std::string Format(double value, double size = 0.0) {
  constexpr int kDigits = 10;
  constexpr double kRounding = 1e-12;
  return FormatNumber(std::abs(value) < kRounding * std::max(size, 1e-3) ? 0.0 : value, kDigits);
}

/// The inertia along the link's axes: xx yy zz xy xz yz.
inline Vector6d CalcInertia(const PrintedInertial& body) {
  const Matrix3d R = body.origin.CalcRotation();
  return ToEntries(R * ToTensor(body.I) * R.transpose());
}

/// The places where a format states numbers of a joint: an attribute of its element, or of a child as
/// "limit/lower"; in a parameter file a key of an entry of "rows" or "joints". None where it has none.
struct JointKeys {
  const char* name;
  const char* types[5];  ///< By JointKind.
  const char* axis;
  const char* anchor;
  const char* scalars[kNumJointScalars];  ///< By JointScalar.
  const char* between = " ";              ///< Numbers of a list,
  const char* list = "{}";                ///< which stand in this.
};

/// Writes what differs of the links of a robot into a file of one format.
class RepairWriter {
 public:
  RepairWriter(const DescriptionFile& file, const JointKeys& keys, const PrintedRobot& before,
               const PrintedRobot& after)
      : before_(before), after_(after), file_(file.path().filename().string()), keys_(keys) {}

 protected:
  ~RepairWriter() = default;
  /// Sets what a path of JointKeys names of the joint that moves a link.
  virtual void SetOfJoint(const PrintedLink& link, const std::string& path, const std::string& value) = 0;
  virtual void WriteRange(const PrintedLink& link, double lower, double upper) = 0;
  virtual void WriteMimic(const PrintedLink& link, const std::optional<PrintedMimic>& /*mimic*/) {
    RefuseIf(true, link, "its coupling");
  }
  template <typename Vector>
  [[nodiscard]] std::string JoinVector(const Vector& values) const {
    std::string text;
    const double size = values.cwiseAbs().maxCoeff();
    for (const double value : values) text += (text.empty() ? "" : keys_.between) + Format(value, size);
    return fmt::format(fmt::runtime(keys_.list), text);
  }

  [[noreturn]] void Refuse(const std::string& why) const {
    throw InputError(file_ + ": cannot be repaired: " + why);
  }
  void RefuseIf(bool is_changed, const PrintedLink& link, const char* what) const {
    if (is_changed) Refuse(fmt::format("joint {}: {} must be written by hand", link.joint.name, what));
  }

  /// All of a joint but its origin.
  void WriteJoint(int i) {
    const PrintedLink& given = before_.link(i);
    const PrintedJoint& before = given.joint;
    const PrintedJoint& after = after_.link(i).joint;
    const auto set = [&](bool is_other, const char* path, const char* what, const auto& format) {
      if (!is_other) return;
      RefuseIf(path == nullptr, given, what);
      SetOfJoint(given, path, format());
    };
    set(after.kind != before.kind, keys_.types[static_cast<size_t>(after.kind)] == nullptr ? nullptr : "type",
        "its type", [&] { return std::string(keys_.types[static_cast<size_t>(after.kind)]); });
    set(after.axis != before.axis, keys_.axis, "its axis", [&] { return JoinVector(after.axis); });
    set(after.anchor != before.anchor, keys_.anchor, "a point of its axis",
        [&] { return JoinVector(after.anchor); });
    const auto find = [](const std::optional<std::array<PrintedScalar, 2>>& range) {
      return range ? std::optional(std::pair((*range)[0].value, (*range)[1].value)) : std::nullopt;
    };
    if (const auto range = find(after.range); range != find(before.range)) {
      RefuseIf(!range, given, "a range that is too much");
      WriteRange(after_.link(i), range->first, range->second);
    }
    for (size_t k = 0; k < kNumJointScalars; ++k) {
      const double was = before.scalars[k] ? before.scalars[k]->value : 0.0;
      const double is = after.scalars[k] ? after.scalars[k]->value : 0.0;
      set(was != is, keys_.scalars[k], NameSite(ToSite(static_cast<JointScalar>(k))),
          [&] { return Format(is); });
    }
    const auto state = [](const std::optional<PrintedMimic>& m) {
      return m ? std::optional(std::tuple(m->leader, m->multiplier.value, m->offset.value)) : std::nullopt;
    };
    if (state(before.mimic) != state(after.mimic)) WriteMimic(given, after.mimic);
    set(after.name != before.name, keys_.name, "its name", [&] { return after.name; });
  }

  const PrintedRobot& before_;
  const PrintedRobot& after_;

 private:
  std::string file_;
  const JointKeys& keys_;
};

}  // namespace dexcheck
