#pragma once

// The terms of the law as whole matrices.

#include "controller/control/grasp_model.h"
#include "harness/checks/law_reference.h"
#include "harness/descriptions/engine_provider.h"

namespace dexcheck {

/// By the engine: all that the table of terms has evaluated on its side. What multiplies only the slip,
/// C_bar' and J_B_dot', and X_o's branch of the angles are the model's.
/// @param contacts whether the engine has contacts to compare; bonds it has not, and theirs are the model's.
/// @param terms of this engine and model at each step, or new: entries that are always zero are not written.
/// It keeps pointers into the model.
void ReadEngineTerms(const EngineProvider& engine, const GraspModel& model, const MeasuredState& state,
                     bool contacts, LawTerms* terms);

}  // namespace dexcheck
