#pragma once

#include <mujoco/mujoco.h>

namespace dexcheck {

/// qfrc_passive, those of tendons included, after positions (mj_comPos) and velocities (mj_comVel): springs,
/// damping, fluid. The engine's mj_passive alone takes the tendons' lengths and rates as they happen to
/// stand.
void CalcPassiveForces(const mjModel& model, mjData* data);

}  // namespace dexcheck
