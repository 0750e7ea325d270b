#pragma once

// Entries of M span eight decades, from the platform's mass to a phalanx's inertia. Divided by the geometric
// mean of its diagonal entries, each is at most 1, and a finger's error counts as much as the platform's.

#include "controller/common/types.h"

namespace dexcheck::testing {

/// X_ij / sqrt(M_ii M_jj), for X = M, C or a difference of such.
inline MatrixXd ScaleByMass(const MatrixXd& X, const MatrixXd& M) {
  const VectorXd scale = M.diagonal().cwiseSqrt().cwiseInverse();
  return scale.asDiagonal() * X * scale.asDiagonal();
}

/// f_i / sqrt(M_ii), for generalised forces.
inline VectorXd ScaleForceByMass(const VectorXd& force, const MatrixXd& M) {
  return force.cwiseQuotient(M.diagonal().cwiseSqrt());
}

}  // namespace dexcheck::testing
