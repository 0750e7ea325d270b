#pragma once

// Terms of model and engine at one state, as JSON by their names in controller/NOTATION.md; matrices are
// lists of rows.

#include "harness/cli/json_matrix.h"
#include "harness/engine/adapter.h"
#include "harness/scenario/state_file.h"

namespace dexcheck::cli {

/// Adds every term of the robot, those of the object when the state has one, and those of the contacts when
/// it has them.
/// @throws SingularityError where the object's ZYZ angles are singular, or where contacts cannot be
/// evaluated.
void AddModelTerms(const RobotModel& model, const State& state, Json* out);

/// The engine's values of the model's terms of the same names: M_bar, C_bar_xi, gravity, friction, F_bar,
/// bias, energies and momenta, fingertip_pose, and pose, J_f, J_f_dot_xi of each frame.
Json EvaluateEngineTerms(const Adapter& adapter, const State& state);

}  // namespace dexcheck::cli
