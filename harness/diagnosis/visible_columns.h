#pragma once

#include "harness/diagnosis/cause_estimator.h"

namespace dexcheck {

/// What of a candidate shows above the noise: amplitudes are basis * a.
struct Visible {
  MatrixXd columns;  // N x r
  MatrixXd basis;    // p x r
  VectorXd unit;     // p, of the amplitudes: diag(unit)^-1 basis is orthonormal
};

/// @param noise of the sum over all rows.
Visible FindVisible(const Candidate& candidate, double noise);

/// Standard errors of the amplitudes (p), infinite for those that the visible ones do not tell. @param
/// covariance of these (r x r).
VectorXd CalcErrors(const Visible& visible, const MatrixXd& covariance);

}  // namespace dexcheck
