#include "controller/contact/fingertip_rim.h"

#include <cmath>
#include <limits>

namespace dexcheck {

double CalcRimDistance(const Frame& fingertip, const Vector3d& p) {
  if (!fingertip.hemisphere) return std::numeric_limits<double>::infinity();
  // pi/2 - angle = atan2 of the height above the rim's plane and the distance from the axis
  const double height = fingertip.hemisphere->dot(p);
  const double aside = fingertip.hemisphere->cross(p).norm();
  return fingertip.sphere_radius.value() * std::atan2(height, aside);
}

}  // namespace dexcheck
