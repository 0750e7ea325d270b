#include "harness/plant/imperfections.h"

#include <algorithm>

#include "controller/common/errors.h"
#include "controller/common/text.h"

namespace dexcheck {
bool ByName::Is(double value) const {
  return all == value &&
         std::ranges::all_of(groups, [&](const auto& group) { return group.second == value; });
}

VectorXd ByName::Resolve(std::span<const std::string> names, const std::string& source) const {
  VectorXd values = VectorXd::Constant(static_cast<Eigen::Index>(names.size()), all);
  for (const auto& [group, value] : groups) {
    const bool is_name = std::ranges::find(names, group) != names.end();
    bool found = false;
    for (size_t i = 0; i < names.size(); ++i) {
      const bool fits = is_name ? names[i] == group : group == "all" || names[i].starts_with(group);
      if (!fits) continue;
      values[static_cast<Eigen::Index>(i)] = value;
      found = true;
    }
    if (found) continue;
    throw InputError(source + ": " + key + ": fits no name of the robot" +
                     SuggestInBrackets(group, {names.begin(), names.end()}, "") + ", got " + Quote(group));
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
         backlash.Is(0.0) && delay == 0.0 && !saturates();
}

bool MismatchOptions::is_none() const {
  return mass.Is(1.0) && mass_within.Is(0.0) && damping.Is(1.0) && armature.Is(1.0) &&
         std::ranges::all_of(com, [](const auto& shift) { return shift.second.isZero(0.0); }) &&
         payloads.empty() && slope.isZero(0.0) && !friction;
}

bool Imperfections::is_ideal() const {
  return sensing.is_exact() && actuation.is_exact() && disturbances.empty() && mismatch.is_none();
}

}  // namespace dexcheck
