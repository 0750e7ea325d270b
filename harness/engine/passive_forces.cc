#include "harness/engine/passive_forces.h"

#include "harness/engine/mujoco_release.h"

namespace dexcheck {

void CalcPassiveForces(const mjModel& model, mjData* data) {
  if (model.ntendon > 0) {
    mj_tendon(&model, data);
    CalcTendonVelocities(model, data);
  }
  mj_passive(&model, data);
}

}  // namespace dexcheck
