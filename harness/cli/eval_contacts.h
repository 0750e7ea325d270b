#pragma once

#include "controller/dynamics/model_terms.h"
#include "harness/cli/eval_terms.h"
#include "harness/scenario/state_file.h"

namespace dexcheck::cli {

/// Adds the terms of section 4 for hard fingers at the state's contacts: G, G_dot, J_B, J_B_dot, and for each
/// contact its coordinates, their rates, frames and surface parameters. Without an object the contacts are
/// taken as at rest on both bodies (kappa_dot = 0).
/// @param terms at the state, reduced coordinates.
/// @throws InputError when a contact point is off the surface; SingularityError when a chart or (40) is
/// singular.
void AddContactTerms(const ModelTerms& terms, const State& state, Json* out);

}  // namespace dexcheck::cli
