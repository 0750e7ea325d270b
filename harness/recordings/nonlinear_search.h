#pragma once

// The nonlinear fault that explains a recording best.

#include <optional>

#include "harness/recordings/nonlinear_faults.h"

namespace dexcheck {

/// Returns the fault that explains most of what gravity, inertia and friction do not, if one explains much.
std::optional<NonlinearFault> FindNonlinearFault(const RobotModel& model, Recording recording);

}  // namespace dexcheck
