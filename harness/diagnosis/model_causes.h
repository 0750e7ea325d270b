#pragma once

// Which numbers of a model's description differ from those of the engine's.

#include <mujoco/mujoco.h>

#include "controller/model/robot_model.h"
#include "harness/diagnosis/causes.h"

namespace dexcheck {

/// Facts of the model's geometry and bodies: "joint elbow: origin differs: d 0.394 in the model, 0.384 in the
/// MJCF". None where the search explains only a part.
Causes ListModelCauses(const RobotModel& model, const mjModel& engine);

}  // namespace dexcheck
