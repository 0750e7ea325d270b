#include "harness/engine/passive_forces.h"

namespace dexcheck {

void CalcPassiveForces(const mjModel& model, mjData* data) {
  if (model.ntendon > 0) {
    mj_tendon(&model, data);
    // ten_velocity = ten_J qvel
    if (mj_isSparse(&model) != 0) {
      for (int i = 0; i < model.ntendon; ++i) {
        const int row = data->ten_J_rowadr[i];
        data->ten_velocity[i] = 0.0;
        for (int k = row; k < row + data->ten_J_rownnz[i]; ++k)
          data->ten_velocity[i] += data->ten_J[k] * data->qvel[data->ten_J_colind[k]];
      }
    } else {
      mju_mulMatVec(data->ten_velocity, data->ten_J, data->qvel, model.ntendon, model.nv);
    }
  }
  mj_passive(&model, data);
}

}  // namespace dexcheck
