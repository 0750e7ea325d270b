#pragma once

// How far amplitudes are off, by how far parts of the recordings disagree about them.

#include <vector>

#include "harness/recordings/torque_rows.h"

namespace dexcheck {

/// Some rows of a regression: C^T C (p x p) and C^T r, of the residual of y.
struct RowCluster {
  MatrixXd products;
  VectorXd scores;
};

/// Variances of least-squares amplitudes (p) whose rows have errors that agree within clusters, whatever
/// they are. [Bell McCaffrey 2002] (bias-reduced linearisation, CR2): errors that are white give, on average,
/// what they give without clusters. What one cluster alone says of an amplitude is left out.
VectorXd CalcClusteredVariances(const std::vector<RowCluster>& clusters);

/// Errors of amplitudes of such columns, by how far stretches of each recording disagree about them, or
/// joints, whichever is more. @param left of rows.
VectorXd CalcClusteredErrors(const TorqueRows& rows, const VectorXd& left,
                             const std::vector<Eigen::Index>& columns);

}  // namespace dexcheck
