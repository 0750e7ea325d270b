#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <cstdlib>

namespace dexcheck::testing {

/// Factor on every tolerance, from the environment variable TOL_SCALE. TOL_SCALE=0 makes each comparison fail
/// and so print its residual.
inline double TolScale() {
  static const double scale = [] {
    const char* text = std::getenv("TOL_SCALE");
    return text == nullptr ? 1.0 : std::atof(text);
  }();
  return scale;
}

/// Success when `actual` and `expected` have one shape and every entry differs by at most `tolerance`
/// (absolute). NaN never passes. The message names the worst entry, both values, their difference.
inline ::testing::AssertionResult MatrixNear(const Eigen::Ref<const Eigen::MatrixXd>& actual,
                                             const Eigen::Ref<const Eigen::MatrixXd>& expected,
                                             double tolerance) {
  if (actual.rows() != expected.rows() || actual.cols() != expected.cols()) {
    return ::testing::AssertionFailure() << "shape " << actual.rows() << "x" << actual.cols() << " against "
                                         << expected.rows() << "x" << expected.cols();
  }
  const double bound = tolerance * TolScale();
  double worst = -1.0;
  Eigen::Index worst_row = 0;
  Eigen::Index worst_col = 0;
  for (Eigen::Index col = 0; col < actual.cols(); ++col) {
    for (Eigen::Index row = 0; row < actual.rows(); ++row) {
      double difference = std::abs(actual(row, col) - expected(row, col));
      if (std::isnan(difference)) difference = std::numeric_limits<double>::infinity();
      if (difference > worst) {
        worst = difference;
        worst_row = row;
        worst_col = col;
      }
    }
  }
  if (worst <= bound && (TolScale() > 0.0 || worst < 0.0)) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure()
         << "entry (" << worst_row << ", " << worst_col << "): " << actual(worst_row, worst_col)
         << " against " << expected(worst_row, worst_col) << ", difference " << worst << ", tolerance "
         << bound;
}

}  // namespace dexcheck::testing
