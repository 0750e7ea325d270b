#pragma once

#include <mujoco/mujoco.h>

namespace dexcheck {

/// The whole mass matrix, nv x nv.
inline void ExpandMass(const mjModel& m, const mjData& d, mjtNum* M) {
#if mjVERSION_HEADER >= 3010000
  mj_fullM(&m, &d, M);
#else
  mj_fullM(&m, M, d.qM);
#endif
}

}  // namespace dexcheck
