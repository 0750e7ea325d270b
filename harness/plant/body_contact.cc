#include "harness/plant/body_contact.h"

#include <cmath>

#include "harness/engine/map_vector.h"

namespace dexcheck {

BodyContact ReadBodyContact(const mjModel& m, const mjData& d, int body, int other) {
  BodyContact result;
  for (int i = 0; i < d.ncon; ++i) {
    const mjContact& c = d.contact[i];
    const int body1 = m.geom_bodyid[c.geom1];
    const int body2 = m.geom_bodyid[c.geom2];
    const bool first = body1 == body && body2 == other;
    const bool second = body2 == body && body1 == other;
    if ((!first && !second) || c.efc_address < 0 || c.dim < 3) continue;
    if (result.touching && c.dist >= result.distance) continue;
    result.touching = true;
    result.distance = c.dist;
    // Velocity of the second geom against the first, along the contact's tangents.
    const RotationMap frame(c.frame);
    const mjtNum* const velocity = d.efc_vel + c.efc_address;
    result.slip = (velocity[1] * frame.row(1) + velocity[2] * frame.row(2)).transpose();
    if (first) result.slip = -result.slip;
    mjtNum force[6];
    mj_contactForce(&m, &d, i, force);
    const double tangential = std::hypot(force[1] / c.friction[0], force[2] / c.friction[1]);
    result.cone_use = force[0] > 0.0 ? tangential / force[0] : 0.0;
    result.cone_margin = c.friction[0] * (force[0] - tangential);
  }
  return result;
}

}  // namespace dexcheck
