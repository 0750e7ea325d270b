#pragma once

#include <mujoco/mujoco.h>

#include "controller/common/types.h"

namespace dexcheck {

/// Three numbers of the engine.
inline Vector3d MapVector(const mjtNum* v) { return {v[0], v[1], v[2]}; }

}  // namespace dexcheck
