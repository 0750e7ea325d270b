#pragma once

// Columns of all candidates as far as they show, and what each leaves of a residual beside others.

#include <span>
#include <vector>

#include "harness/diagnosis/cause_estimator.h"

namespace dexcheck {

/// The part of a candidate that shows above the noise: amplitudes are basis * a.
struct Visible {
  MatrixXd columns;  // N x r
  MatrixXd basis;    // p x r
  VectorXd unit;     // p, of the amplitudes: diag(unit)^-1 basis is orthonormal
};

/// Standard errors of the amplitudes (p), infinite for those that the visible ones do not determine. @param
/// covariance of these (r x r).
VectorXd CalcErrors(const Visible& visible, const MatrixXd& covariance);

/// All candidates' visible columns (N x W, W of all together).
class VisibleColumns {
 public:
  /// @param y (N) what is to be explained. @param noise of the sum over all rows. @param independent part of
  /// a column beside others that counts.
  VisibleColumns(std::span<const Candidate> candidates, const VectorXd& y, double noise, double independent);

  [[nodiscard]] Eigen::Index CountOf(size_t candidate) const {
    return begins_[candidate + 1] - begins_[candidate];
  }
  [[nodiscard]] auto Of(size_t candidate) const {
    return all_.middleCols(begins_[candidate], CountOf(candidate));
  }
  /// Without its columns.
  [[nodiscard]] const Visible& visible(size_t candidate) const { return visible_[candidate]; }
  /// Returns the columns of these, side by side.
  [[nodiscard]] MatrixXd Collect(const std::vector<size_t>& set) const;

  /// Square of what each candidate leaves of y beside others, to 1e-8 of `floor` and itself.
  /// @param Q (N x k) orthonormal columns of the others' range. @param r (N) what these leave of y.
  [[nodiscard]] VectorXd CalcLeft(const MatrixXd& Q, const VectorXd& r, double floor) const;

 private:
  /// Q^T of all columns (W x k, transposed). What the last Q had in the same place is not computed again.
  const MatrixXd& Project(const MatrixXd& Q) const;
  [[nodiscard]] double CalcExactly(size_t candidate, const MatrixXd& Q, VectorXd r) const;

  const VectorXd& y_;
  double independent_;
  std::vector<Visible> visible_;
  std::vector<Eigen::Index> begins_;
  MatrixXd all_;
  VectorXd sizes_, with_y_;      // of the columns, and their products with y
  std::vector<MatrixXd> grams_;  // of each candidate's columns, divided by their sizes
  mutable MatrixXd last_Q_, projected_;
};

}  // namespace dexcheck
