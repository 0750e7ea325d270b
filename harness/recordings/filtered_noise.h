#pragma once

// Noise that a filter has made similar in rows that follow each other.

#include <algorithm>
#include <vector>

#include "controller/common/types.h"

namespace dexcheck {

/// Noise of unit variance behind one filter, in a window of rows.
struct FilterShape {
  VectorXd covariances;  ///< Of what a polynomial leaves of it, by lag in rows from 0: means over the window.
  double smoothed;       ///< Variance of the sum of all rows by the weights of smoothing.
  double halves;         ///< Variance of the difference of two such sums.
};

/// Largest lag of covariances that are compared, in rows, in windows of so many.
inline Eigen::Index CountLags(Eigen::Index rows) { return std::min<Eigen::Index>(rows / 2, 64); }

/// Returns means of products of a residual's rows that are so many rows apart.
VectorXd CalcCovariances(const Eigen::Ref<const VectorXd>& residual, Eigen::Index lags);

/// White noise, then filters of first and second order and means over some rows, of several lengths.
/// @param basis of the polynomials in a window, rows x (order + 1), with orthonormal columns.
/// @param smoothed, halves weights of the two sums.
std::vector<FilterShape> ListFilterShapes(const MatrixXd& basis, const Eigen::RowVectorXd& smoothed,
                                          const Eigen::RowVectorXd& halves);

/// Returns the ratio of the standard deviation of smoothed noise to that of the halves' difference, for white
/// noise with the filtered noise that is most like these covariances.
double CalcSmoothedRatio(const VectorXd& covariances, const std::vector<FilterShape>& shapes);

}  // namespace dexcheck
