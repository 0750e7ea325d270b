#include "harness/checks/wheel_rolling.h"

namespace dexcheck {

Vector2d CalcRollingTwist(const Base& base, const VectorXd& xi) {
  if (base.velocity == DriveVelocity::kTwist) return xi.head<2>();
  const double r = base.wheel_radius;
  return {0.5 * r * (xi[0] + xi[1]), r * (xi[0] - xi[1]) / base.wheel_distance};
}

Vector2d CalcRollingMismatch(const Base& base, const VectorXd& xi, const Vector2d& rates) {
  const Vector2d twist = CalcRollingTwist(base, xi);
  const double turn = 0.5 * base.wheel_distance * twist[1];
  return Vector2d(twist[0] + turn, twist[0] - turn) - base.wheel_radius * rates;
}

}  // namespace dexcheck
