#include "harness/plant/imperfections.h"

#include <algorithm>
#include <string_view>

#include "controller/common/errors.h"
#include "controller/common/text.h"

namespace dexcheck {
namespace {

/// Whether a name is that of the pattern, in which one * stands for any letters.
bool Fits(std::string_view pattern, std::string_view name) {
  const size_t star = pattern.find('*');
  if (star == std::string_view::npos) return pattern == name;
  const std::string_view head = pattern.substr(0, star);
  const std::string_view tail = pattern.substr(star + 1);
  return name.size() >= head.size() + tail.size() && name.starts_with(head) && name.ends_with(tail);
}

}  // namespace

bool ByName::Is(double value) const {
  return all == value &&
         std::all_of(groups.begin(), groups.end(), [&](const auto& group) { return group.second == value; });
}

VectorXd ByName::Resolve(std::span<const std::string> names, const std::string& source) const {
  VectorXd values = VectorXd::Constant(static_cast<Eigen::Index>(names.size()), all);
  for (const auto& [pattern, value] : groups) {
    bool found = false;
    for (size_t i = 0; i < names.size(); ++i) {
      if (!Fits(pattern, names[i])) continue;
      values[static_cast<Eigen::Index>(i)] = value;
      found = true;
    }
    if (found) continue;
    const std::string nearest = FindNearest(pattern, {names.begin(), names.end()});
    throw InputError(source + ": " + key + ": fits no name of the robot" +
                     (nearest.empty() ? "" : " (" + Quote(nearest) + "?)") + ", got " + Quote(pattern));
  }
  return values;
}

bool SensingOptions::is_exact() const {
  return joint_counts.Is(0.0) && joint_noise.Is(0.0) && velocity_noise.Is(0.0) &&
         velocity == VelocitySource::kMeasured && !odometry && object_position_noise == 0.0 &&
         object_orientation_noise == 0.0 && object_rate == 0.0 && object_latency == 0.0 &&
         object_velocity == VelocitySource::kMeasured && contact_force_noise == 0.0 && latency == 0.0 &&
         contact_error == 0.0;
}

bool ActuationOptions::is_exact() const {
  return torque_step.Is(0.0) && gain_error.Is(0.0) && lag.Is(0.0) && coulomb.Is(0.0) && stribeck.Is(0.0) &&
         backlash.Is(0.0) && delay == 0.0 && !saturate;
}

bool MismatchOptions::is_none() const {
  return mass.Is(1.0) && mass_within.Is(0.0) && damping.Is(1.0) && armature.Is(1.0) &&
         std::all_of(com.begin(), com.end(), [](const auto& shift) { return shift.second.isZero(0.0); }) &&
         payloads.empty() && slope.isZero(0.0);
}

bool Imperfections::is_ideal() const {
  return sensing.is_exact() && actuation.is_exact() && disturbances.empty() && mismatch.is_none();
}

}  // namespace dexcheck
