#pragma once

// Twist and wheel rates of a differential drive in the plant: a wheel at y on the axle rolls at (v - w y) /
// r. The controller has formulas of its own (controller/model/platform.h).

#include "controller/model/robot_model.h"

namespace dexcheck {

/// Rates of the wheels at y = -b/2 (right) and b/2 (left), rad/s. @param twist [v; w], m/s and rad/s.
inline Vector2d CalcWheelRatesOfTwist(const Base& base, const Vector2d& twist) {
  const double y = 0.5 * base.wheel_distance;
  return Vector2d(twist[0] + twist[1] * y, twist[0] - twist[1] * y) / base.wheel_radius;
}

/// Returns the twist at which the wheels have these rates.
inline Vector2d CalcTwist(const Base& base, const Vector2d& rates) {
  const double r = base.wheel_radius;
  return {0.5 * r * rates.sum(), r * (rates[0] - rates[1]) / base.wheel_distance};
}

/// The base's entries of xi at this twist.
inline Vector2d CalcDriveVelocityOfTwist(const Base& base, const Vector2d& twist) {
  return base.velocity == DriveVelocity::kTwist ? twist : CalcWheelRatesOfTwist(base, twist);
}

}  // namespace dexcheck
