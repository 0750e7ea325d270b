#pragma once

// Sections 4.4 and 5 at one state, as JSON by their names in controller/NOTATION.md.

#include <span>

#include "controller/contact/contact_geometry.h"
#include "controller/contact/surface.h"
#include "controller/dynamics/model_terms.h"
#include "harness/cli/json_matrix.h"
#include "harness/scenario/state_file.h"

namespace dexcheck::cli {

/// Adds "law": J_B_pinv, N, xi_c, V_o_dot, xi_dot_d (47), F_o, F_N, f_c (49), tau (55), A (56).
/// @param terms with CalcDynamics done. @param state with object, contacts and law. @param kappa of its
/// contacts.
/// @throws InputError where the law has no solution: singular J_B' or G, no contact forces in the cones.
void AddLawTerms(const ModelTerms& terms, const State& state, const Surface& surface,
                 std::span<const ContactCoordinates> kappa, Json* out);

}  // namespace dexcheck::cli
