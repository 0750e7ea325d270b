#include "harness/recordings/filtered_noise.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "harness/base/ranges.h"

namespace dexcheck {
namespace {

using Eigen::Index;

constexpr Index kMostOrder = 9;  // of the polynomials that follow all that a robot does

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

/// Returns the mean square of the smoothed error of values that were rounded to multiples of a step. Where
/// between two multiples they are is not known.
double CalcRoundingSquare(const VectorXd& values, double step, const Eigen::RowVectorXd& smoothed) {
  constexpr int kPhases = 4;
  double sum = 0.0;
  for (int k = 0; k < kPhases; ++k) {
    const Eigen::ArrayXd steps = values.array() / step + (k + 0.5) / kPhases;
    const double error = step * smoothed.dot((steps.round() - steps).matrix());
    sum += error * error / kPhases;
  }
  return sum;
}

}  // namespace

FilteredNoise::FilteredNoise(Index rows, Index joints, int order)
    : rows_(rows),
      order_(order),
      squares_(static_cast<size_t>(joints)),
      covariances_(MatrixXd::Zero(CountLags() + 1, joints)),
      rounding_(VectorXd::Zero(joints)) {
  constexpr Index kFewestParts = 8, kLongest = 12;
  const Index parts = std::max(kFewestParts, rows / kLongest);
  for (Index k = 0; k < rows; ++k) halves_[k * parts / rows % 2].push_back(k);
}

Index FilteredNoise::CountLags() const {
  constexpr Index kMost = 64;
  return std::min(rows_ / 2, kMost);
}

void FilteredNoise::SetWindow(const VectorXd& times, const Eigen::RowVectorXd& smoothed) {
  const Index least = order_ + 1;
  MatrixXd powers = MatrixXd::Ones(rows_, std::clamp(rows_ / 3, least, kMostOrder + 1));
  for (Index p = 1; p < powers.cols(); ++p)
    powers.col(p) = powers.col(p - 1).cwiseProduct(times / times.cwiseAbs().maxCoeff());
  smoothed_ = smoothed;
  difference_.setZero(rows_);
  for (const int k : {0, 1}) {
    const MatrixXd half = powers(halves_[k], Eigen::seqN(0, least));
    difference_(halves_[k]) =
        (k == 0 ? 1.0 : -1.0) * half.completeOrthogonalDecomposition().pseudoInverse().row(0);
  }
  difference_ *= smoothed.norm() / difference_.norm();
  basis_ = Eigen::HouseholderQR<MatrixXd>(powers).householderQ() * MatrixXd::Identity(rows_, powers.cols());
  if (shapes_.empty()) ListShapes();
}

void FilteredNoise::Add(Index joint, const VectorXd& torque, double quantum) {
  const double difference = difference_.dot(torque);
  squares_[static_cast<size_t>(joint)].push_back(difference * difference);
  const VectorXd fitted = basis_ * (basis_.transpose() * torque);
  const VectorXd left = torque - fitted;
  const double square = left.squaredNorm();
  for (Index lag = 0; lag < covariances_.rows() && square > 0.0; ++lag)
    covariances_(lag, joint) += left.head(rows_ - lag).dot(left.tail(rows_ - lag)) / square;
  if (quantum > 0.0) rounding_[joint] += CalcRoundingSquare(fitted, quantum, smoothed_);
}

FilteredNoise::Shape FilteredNoise::MakeShape(const VectorXd& correlations) const {
  MatrixXd R(rows_, rows_);
  for (Index i = 0; i < rows_; ++i)
    for (Index k = 0; k < rows_; ++k) R(i, k) = correlations[std::abs(i - k)];
  Shape shape{VectorXd(covariances_.rows()), (smoothed_ * R).dot(smoothed_),
              (difference_ * R).dot(difference_)};
  // Diagonals of (1 - B B^T) R (1 - B B^T).
  const MatrixXd RB = R * basis_;
  const MatrixXd half = 0.5 * basis_ * (basis_.transpose() * RB) - RB;
  for (Index lag = 0; lag < shape.covariances.size(); ++lag) {
    const Index count = rows_ - lag;
    shape.covariances[lag] = static_cast<double>(count) * correlations[lag] +
                             half.topRows(count).cwiseProduct(basis_.bottomRows(count)).sum() +
                             half.bottomRows(count).cwiseProduct(basis_.topRows(count)).sum();
  }
  return shape;
}

void FilteredNoise::ListShapes() {
  constexpr double kFinest = 1.4, kMostOfWindow = 0.125;
  shapes_ = {MakeShape(VectorXd::Unit(rows_, 0))};
  const double longest = kMostOfWindow * static_cast<double>(rows_);
  const int count = static_cast<int>(std::ceil(std::log(longest) / std::log(kFinest)));
  for (const Correlation& correlation : kCorrelations)
    for (int i = 0; i < count; ++i) {
      const double length = std::pow(kFinest, i);
      VectorXd correlations(rows_);
      for (Index lag = 0; lag < rows_; ++lag)
        correlations[lag] = correlation(static_cast<double>(lag), length);
      shapes_.push_back(MakeShape(correlations));
    }
}

double FilteredNoise::CalcRatio(const VectorXd& covariances) const {
  const Shape& white = shapes_.front();
  // Noise is filtered only where that says far more: a long filter's noise is hardly seen beside a
  // polynomial, so that little of it would count much.
  constexpr double kFarLess = 0.3;
  double best = std::numeric_limits<double>::infinity(), ratio = 1.0;
  for (const Shape& shape : shapes_) {
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

double FilteredNoise::Calc(Index joint) const {
  constexpr double kMedian = 0.455;  // of chi^2 with one degree of freedom
  const std::vector<double>& squares = squares_[static_cast<size_t>(joint)];
  if (squares.empty()) return 0.0;
  return std::max(std::sqrt(Median(squares) / kMedian) * CalcRatio(covariances_.col(joint)),
                  std::sqrt(rounding_[joint] / static_cast<double>(squares.size())));
}

}  // namespace dexcheck
