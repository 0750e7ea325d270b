#include "controller/contact/fingertip_rim.h"

#include <cmath>

namespace dexcheck {

double CalcRimDistance(double radius, const Vector3d& pole, const Vector3d& p) {
  // pi/2 - angle, of the height above the rim's plane and the distance from the axis
  return radius * std::atan2(pole.dot(p), pole.cross(p).norm());
}

}  // namespace dexcheck
