#pragma once

// What acts on robot and object that the model does not have: forces and moments, other masses and inertias,
// armature, friction and springs of joints, another gravity.

#include "harness/diagnosis/causes.h"
#include "harness/diagnosis/step_store.h"

namespace dexcheck {

/// Explains what the balances leave,
///
///   robot   M_bar' xi_dot + C_bar' xi + F_bar' + J_B'^T f_c - E_bar' tau' = f     (48)
///   object  M_hat V_o_dot + C_hat V_o + N_o - G f_c = w                           (19)
///
/// with the plant's accelerations and forces. f is whitened in the metric of the inertia, |f|_M^-1.
Causes ExplainForces(const StepStore& store);

}  // namespace dexcheck
