#pragma once

// The nonlinear fault that explains a recording best.

#include <optional>

#include "harness/recordings/nonlinear_faults.h"

namespace dexcheck {

/// Returns the fault that explains most of what gravity, inertia and friction do not, if one explains much.
/// @param of_model of the model's geometry; otherwise of the recording.
std::optional<NonlinearFault> FindNonlinearFault(const RobotModel& model, Recording recording, bool of_model);

}  // namespace dexcheck
