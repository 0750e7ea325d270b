#include "harness/engine/wheel_inertia.h"

namespace dexcheck {

WheelInertia CalcWheelInertia(const mjModel& engine, const EngineWheel& wheel) {
  const int body = engine.jnt_bodyid[wheel.joint];
  mjtNum axis[3];
  mjtNum inverse[4];
  mju_negQuat(inverse, engine.body_iquat + 4 * body);
  mju_rotVecQuat(axis, engine.jnt_axis + 3 * wheel.joint, inverse);
  const mjtNum* moments = engine.body_inertia + 3 * body;
  double spin = 0.0;
  for (int k = 0; k < 3; ++k) spin += moments[k] * axis[k] * axis[k];
  return {spin, 0.5 * (moments[0] + moments[1] + moments[2] - spin)};
}

}  // namespace dexcheck
