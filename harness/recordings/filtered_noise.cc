#include "harness/recordings/filtered_noise.h"

#include <cmath>
#include <limits>
#include <numbers>

namespace dexcheck {
namespace {

using Eigen::Index;

/// Correlation of rows that are `lag` apart.
using Correlation = double (*)(double lag, double length);

constexpr Correlation kCorrelations[] = {
    // A filter of first order.
    [](double lag, double length) { return std::exp(-lag / length); },
    // Butterworth's of second order.
    [](double lag, double length) {
      const double x = lag / (std::numbers::sqrt2 * length);
      return std::exp(-x) * (std::cos(x) + std::sin(x));
    },
    // The mean of some rows.
    [](double lag, double length) { return std::max(0.0, 1.0 - lag / length); },
};

FilterShape MakeShape(const VectorXd& correlations, const MatrixXd& basis, const Eigen::RowVectorXd& smoothed,
                      const Eigen::RowVectorXd& halves) {
  const Index rows = basis.rows();
  MatrixXd R(rows, rows);
  for (Index i = 0; i < rows; ++i)
    for (Index k = 0; k < rows; ++k) R(i, k) = correlations[std::abs(i - k)];
  FilterShape shape{VectorXd::Zero(CountLags(rows) + 1), (smoothed * R).dot(smoothed),
                    (halves * R).dot(halves)};
  // (1 - B B^T) R (1 - B B^T), of which diagonals are needed.
  const MatrixXd RB = R * basis;
  const MatrixXd left = 0.5 * basis * (basis.transpose() * RB) - RB;
  for (Index lag = 0; lag < shape.covariances.size(); ++lag) {
    const Index count = rows - lag;
    shape.covariances[lag] = (static_cast<double>(count) * correlations[lag] +
                              (left.topRows(count).cwiseProduct(basis.bottomRows(count))).sum() +
                              (left.bottomRows(count).cwiseProduct(basis.topRows(count))).sum()) /
                             static_cast<double>(rows);
  }
  return shape;
}

}  // namespace

VectorXd CalcCovariances(const Eigen::Ref<const VectorXd>& residual, Index lags) {
  VectorXd covariances(lags + 1);
  for (Index lag = 0; lag <= lags; ++lag) {
    const Index count = residual.size() - lag;
    covariances[lag] = residual.head(count).dot(residual.tail(count)) / static_cast<double>(residual.size());
  }
  return covariances;
}

std::vector<FilterShape> ListFilterShapes(const MatrixXd& basis, const Eigen::RowVectorXd& smoothed,
                                          const Eigen::RowVectorXd& halves) {
  const Index rows = basis.rows();
  std::vector<FilterShape> shapes = {MakeShape(VectorXd::Unit(rows, 0), basis, smoothed, halves)};
  // A filter of an eighth of the window leaves too little that the polynomial does not follow.
  constexpr double kFinest = 1.4, kMostOfWindow = 0.125;
  for (const Correlation& correlation : kCorrelations)
    for (double length = 1.0; length < kMostOfWindow * static_cast<double>(rows); length *= kFinest) {
      VectorXd correlations(rows);
      for (Index lag = 0; lag < rows; ++lag)
        correlations[lag] = correlation(static_cast<double>(lag), length);
      shapes.push_back(MakeShape(correlations, basis, smoothed, halves));
    }
  return shapes;
}

double CalcSmoothedRatio(const VectorXd& covariances, const std::vector<FilterShape>& shapes) {
  const FilterShape& white = shapes.front();
  // The first shape is white; noise is filtered only where that says far more, since what is seen of a long
  // filter's noise is a small part of it.
  constexpr double kFarLess = 0.3;
  double best = std::numeric_limits<double>::infinity(), ratio = 1.0;
  for (const FilterShape& shape : shapes) {
    MatrixXd A(covariances.size(), 2);
    A << white.covariances, shape.covariances;
    Eigen::Vector2d share = A.completeOrthogonalDecomposition().solve(covariances);
    // Variances are not negative.
    for (const int k : {0, 1})
      if (share[k] < 0.0) {
        share[k] = 0.0;
        share[1 - k] = std::max(0.0, A.col(1 - k).dot(covariances) / A.col(1 - k).squaredNorm());
      }
    const double left = (A * share - covariances).squaredNorm();
    if (!(left < best) || share.isZero()) continue;
    best = &shape == &white ? kFarLess * left : left;
    ratio = std::sqrt((share[0] * white.smoothed + share[1] * shape.smoothed) /
                      (share[0] * white.halves + share[1] * shape.halves));
  }
  return ratio;
}

}  // namespace dexcheck
