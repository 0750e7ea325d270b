#include "harness/study/quadratic_model.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace dexcheck {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

enum class Curvature { kNone, kDiagonal, kSymmetric };

size_t CountCoefficients(Curvature curvature, size_t n) {
  if (curvature == Curvature::kSymmetric) return (n + 1) * (n + 2) / 2;
  return curvature == Curvature::kDiagonal ? 2 * n + 1 : n + 1;
}

/// The richest model that so many points determine; none when they are too few.
std::optional<Curvature> ChooseCurvature(size_t points, size_t n) {
  constexpr double kPointsEach = 1.1;
  for (const Curvature curvature : {Curvature::kSymmetric, Curvature::kDiagonal, Curvature::kNone}) {
    if (static_cast<double>(points) >= kPointsEach * static_cast<double>(CountCoefficients(curvature, n)))
      return curvature;
  }
  return std::nullopt;
}

/// Values to be fitted, of points sorted from the best on.
VectorXd ListValues(const std::vector<TriedPoint>& sorted) {
  VectorXd values(static_cast<Eigen::Index>(sorted.size()));
  double worst = 0.0;
  double spread = 0.0;
  for (size_t i = 0; i < sorted.size(); ++i) {
    const Judgement& judgement = sorted[i].judgement;
    double& value = values[static_cast<Eigen::Index>(i)];
    if (judgement.is_feasible() && std::isfinite(judgement.objectives.front())) {
      value = worst = judgement.objectives.front();
      spread = worst - values[0];
    } else {
      value = worst + (spread > 0.0 ? spread : 1.0) * std::min(judgement.violation, 1.0);
    }
  }
  return values;
}

struct Quadratic {
  VectorXd g;  // n
  MatrixXd H;  // n x n
};

/// @param z n x points.
Quadratic Fit(const MatrixXd& z, const VectorXd& values, Curvature curvature) {
  const Eigen::Index n = z.rows();
  const Eigen::Index points = z.cols();
  const auto count = static_cast<Eigen::Index>(CountCoefficients(curvature, static_cast<size_t>(n)));
  MatrixXd normal = MatrixXd::Zero(count, count);
  VectorXd right = VectorXd::Zero(count);
  VectorXd row(count);
  constexpr double kFirst = 20.0;  // weight of the best point; the last one has 1
  for (Eigen::Index k = 0; k < points; ++k) {
    Eigen::Index next = 0;
    row[next++] = 1.0;
    for (Eigen::Index i = 0; i < n; ++i) row[next++] = z(i, k);
    for (Eigen::Index i = 0; i < n && next < count; ++i) {
      row[next++] = 0.5 * z(i, k) * z(i, k);
      for (Eigen::Index j = 0; j < i && curvature == Curvature::kSymmetric; ++j)
        row[next++] = z(i, k) * z(j, k);
    }
    const double rank = static_cast<double>(k) / static_cast<double>(std::max(points - 1, Eigen::Index{1}));
    const double weight = kFirst + rank * (1.0 - kFirst);
    normal.noalias() += weight * row * row.transpose();
    right += weight * values[k] * row;
  }
  // What the points leave open, such as the slope across an edge on which all of them lie, is nought.
  constexpr double kRidge = 1e-10;
  normal.diagonal().array() += kRidge * normal.trace();
  const VectorXd x = normal.ldlt().solve(right);
  Quadratic model{x.segment(1, n), MatrixXd::Zero(n, n)};
  Eigen::Index next = n + 1;
  for (Eigen::Index i = 0; i < n && next < count; ++i) {
    model.H(i, i) = x[next++];
    for (Eigen::Index j = 0; j < i && curvature == Curvature::kSymmetric; ++j)
      model.H(i, j) = model.H(j, i) = x[next++];
  }
  return model;
}

/// Coordinate by coordinate from z = 0; a coordinate along which the model bends down goes to an end.
VectorXd Minimise(const Quadratic& model, const VectorXd& low, const VectorXd& high) {
  constexpr int kSweeps = 200;
  constexpr double kStill = 1e-9;
  VectorXd z = VectorXd::Zero(low.size());
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    double moved = 0.0;
    for (Eigen::Index i = 0; i < z.size(); ++i) {
      const double curvature = model.H(i, i);
      const double slope = model.g[i] + model.H.row(i).dot(z) - curvature * z[i];
      const auto change = [&](double at) { return (slope + 0.5 * curvature * at) * at; };
      const double best = curvature > 0.0                    ? std::clamp(-slope / curvature, low[i], high[i])
                          : change(low[i]) < change(high[i]) ? low[i]
                                                             : high[i];
      moved = std::max(moved, std::abs(best - z[i]));
      z[i] = best;
    }
    if (moved < kStill) break;
  }
  return z;
}

}  // namespace

std::optional<UnitPoint> FindModelMinimum(std::vector<TriedPoint> tried) {
  if (tried.empty()) return std::nullopt;
  const size_t n = tried.front().point.size();
  const auto curvature = ChooseCurvature(tried.size(), n);
  if (!curvature) return std::nullopt;
  std::stable_sort(tried.begin(), tried.end(), [](const TriedPoint& a, const TriedPoint& b) {
    return IsBetter(a.judgement, b.judgement);
  });
  const std::vector<TriedPoint> used(
      tried.begin(), tried.begin() + static_cast<std::ptrdiff_t>(
                                         std::min(tried.size(), 2 * CountCoefficients(*curvature, n))));
  MatrixXd x(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(used.size()));
  for (size_t k = 0; k < used.size(); ++k)
    x.col(static_cast<Eigen::Index>(k)) = VectorXd::Map(used[k].point.data(), x.rows());
  const VectorXd best = x.col(0);
  const VectorXd least = x.rowwise().minCoeff();
  const VectorXd most = x.rowwise().maxCoeff();
  constexpr double kSmallest = 1e-6;  // of an extent
  const VectorXd extent = (most - least).cwiseMax(kSmallest);
  const MatrixXd z = (x.colwise() - best).array().colwise() / extent.array();
  const auto place = [&](const VectorXd& end) -> VectorXd {
    return (end.cwiseMax(0.0).cwiseMin(1.0) - best).cwiseQuotient(extent);
  };
  const VectorXd minimum =
      Minimise(Fit(z, ListValues(used), *curvature), place(least - 0.5 * extent), place(most + 0.5 * extent));
  constexpr double kEdge = 1e-9;  // rounding: what is so near to an edge lies on it
  const VectorXd found = (best + minimum.cwiseProduct(extent)).unaryExpr([](double at) {
    return at < kEdge ? 0.0 : at > 1.0 - kEdge ? 1.0 : at;
  });
  constexpr double kTried = 1e-4;  // of a range: so near to a point is that point
  for (const TriedPoint& other : tried) {
    if ((VectorXd::Map(other.point.data(), found.size()) - found).cwiseAbs().maxCoeff() < kTried)
      return std::nullopt;
  }
  return UnitPoint(found.data(), found.data() + found.size());
}

}  // namespace dexcheck
