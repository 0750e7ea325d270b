#pragma once

#include <span>

#include "controller/contact/contact_geometry.h"
#include "controller/contact/surface.h"
#include "controller/dynamics/model_terms.h"
#include "harness/cli/json_matrix.h"
#include "harness/scenario/state_file.h"

namespace dexcheck::cli {

/// Adds the terms of section 4 for hard fingers at the state's contacts: G, G_dot, J_B, J_B_dot, and for each
/// contact its coordinates, their rates, frames and surface parameters. Without an object the contacts are
/// taken as at rest on both bodies (kappa_dot = 0).
/// @param terms at the state, reduced coordinates.
/// @throws InputError when a contact point is off the surface; SingularityError when a chart or (40) is
/// singular.
void AddContactTerms(const ModelTerms& terms, const State& state, Json* out);

// Sections 4.4 and 5 at one state, as JSON by their names in controller/NOTATION.md.

/// Adds "law": J_B_pinv, N, xi_c, V_o_dot, xi_dot_d (47), F_o, F_N, f_c (49), tau (55), A (56).
/// @param terms with CalcDynamics done. @param state with object, contacts and law. @param kappa of its
/// contacts.
/// @throws InputError where the law has no solution: singular J_B' or G, no contact forces in the cones.
void AddLawTerms(const ModelTerms& terms, const State& state, const Surface& surface,
                 std::span<const ContactCoordinates> kappa, Json* out);

}  // namespace dexcheck::cli
