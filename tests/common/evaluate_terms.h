#pragma once

#include "harness/descriptions/term_results.h"

namespace dexcheck::testing {

/// All that a program could provide, of a provider at one state.
inline TermResults EvaluateTerms(DynamicsProvider* provider, const VectorXd& q, const VectorXd& xi) {
  provider->SetState({.q = q, .xi = xi, .w = {}});
  const Eigen::Index n = xi.size();
  const auto read = [&](Term term, Eigen::Index rows, Eigen::Index cols) {
    MatrixXd numbers = MatrixXd::Zero(rows, cols);
    provider->Read(term, numbers);
    return numbers;
  };
  return {read(Term::kMBar, n, n),
          read(Term::kCBarXi, n, 1),
          read(Term::kGravity, n, 1),
          read(Term::kBias, n, 1),
          read(Term::kFriction, n, 1),
          read(Term::kKineticEnergy, 1, 1)(0, 0),
          read(Term::kPotentialEnergy, 1, 1)(0, 0)};
}

}  // namespace dexcheck::testing
