#include "controller/grasp/force_closure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "controller/common/errors.h"
#include "controller/grasp/grasp_rank.h"
#include "controller/grasp/growing_polytope.h"

namespace dexcheck {
namespace {

using grasp_internal::GrowingPolytope;

// The set W of scaled wrenches [force; moment / length] that normalised contact forces can give.
class WrenchSet {
 public:
  WrenchSet(const Eigen::Ref<const Matrix6Xd>& G, const Eigen::Ref<const VectorXd>& mu,
            const ForceClosureOptions& options)
      : G_(G), mu_(mu) {
    G_.bottomRows<3>() /= options.length;
  }

  // The direction in which W is thinnest: that of the wrenches of each contact's normal and friction forces.
  // A coefficient above one makes W no thinner.
  grasp_internal::WeakestDirection FindThinnest() const {
    Matrix6Xd wrenches = G_;
    for (Eigen::Index i = 0; i < mu_.size(); ++i) wrenches.middleCols<2>(3 * i) *= std::min(mu_[i], 1.0);
    return grasp_internal::FindWeakestDirection(wrenches);
  }

  // The point of W farthest along n. A contact gives most with its force on the cone's boundary, along the
  // tangential part of g = G_i^T n: h_i = g3 + mu |(g1, g2)|, per newton of normal force.
  Vector6d FindFarthest(const Vector6d& n) const {
    Vector6d best = Vector6d::Zero();
    double best_h = 0.0;
    for (Eigen::Index i = 0; i < mu_.size(); ++i) {
      const Vector3d g = G_.middleCols<3>(3 * i).transpose() * n;
      const double tangential = std::hypot(g.x(), g.y());
      const double h = g.z() + mu_[i] * tangential;
      if (h <= best_h) continue;
      const double scale = tangential > 0.0 ? mu_[i] / tangential : 0.0;
      best_h = h;
      best = G_.middleCols<3>(3 * i) * Vector3d(scale * g.x(), scale * g.y(), 1.0);
    }
    return best;
  }

 private:
  Matrix6Xd G_;
  VectorXd mu_;
};

void RequireValid(const Eigen::Ref<const Matrix6Xd>& G, const Eigen::Ref<const VectorXd>& mu,
                  const ForceClosureOptions& options) {
  Require(mu.size() > 0, "mu", "must not be empty", 0.0);
  Require(G.cols() == 3 * mu.size(), "G", "must have three columns for each mu", G.cols());
  Require(G.allFinite(), "G", "must be finite", std::numeric_limits<double>::quiet_NaN());
  for (Eigen::Index i = 0; i < mu.size(); ++i) {
    Require(std::isfinite(mu[i]) && mu[i] > 0.0, "mu", "must be positive and finite", mu[i]);
  }
  RequirePositive(options.length, "length");
  Require(options.tolerance > 0.0 && options.tolerance < 1.0, "tolerance", "must be in (0, 1)",
          options.tolerance);
  Require(options.zero >= 0.0, "zero", "must not be negative", options.zero);
  Require(options.max_vertices >= 7, "max_vertices", "must be at least 7", options.max_vertices);
}

// Seven points of W that span R^6: the first anywhere, each next one farthest from the plane of those before.
std::array<Vector6d, 7> FindSimplex(const WrenchSet& W) {
  std::array<Vector6d, 7> points;
  points[0] = W.FindFarthest(Vector6d::Ones());
  Matrix6d across = Matrix6d::Identity();  // projects onto what is normal to the edges so far
  for (std::size_t k = 1; k <= 6; ++k) {
    Eigen::Index longest = 0;
    across.colwise().squaredNorm().maxCoeff(&longest);
    const Vector6d n = across.col(longest).normalized();
    const Vector6d plus = W.FindFarthest(n);
    const Vector6d minus = W.FindFarthest(-n);
    const double distance_plus = std::abs(n.dot(plus - points[0]));
    const double distance_minus = std::abs(n.dot(minus - points[0]));
    points[k] = distance_plus >= distance_minus ? plus : minus;
    const Vector6d outward = (across * (points[k] - points[0])).normalized();
    across -= outward * outward.transpose();
  }
  return points;
}

}  // namespace

ForceClosureResult CalcForceClosure(const Eigen::Ref<const Matrix6Xd>& G,
                                    const Eigen::Ref<const VectorXd>& mu,
                                    const ForceClosureOptions& options) {
  RequireValid(G, mu, options);
  const WrenchSet W(G, mu, options);
  ForceClosureResult result;
  const grasp_internal::WeakestDirection thinnest = W.FindThinnest();
  Vector6d weakest = thinnest.n;
  if (!(thinnest.ratio > grasp_internal::kRankTolerance)) {
    result.status = ForceClosureStatus::kNotForceClosure;
  } else {
    GrowingPolytope polytope(FindSimplex(W));
    result.margin = std::numeric_limits<double>::infinity();
    for (;;) {
      const GrowingPolytope::Facet& facet = polytope.FindNearestFacet();
      const Vector6d point = W.FindFarthest(facet.normal);
      const double support = facet.normal.dot(point);
      result.margin_lower = facet.offset;
      if (support < result.margin) {
        result.margin = support;
        weakest = facet.normal;
      }
      const bool closed = result.margin - result.margin_lower <= options.tolerance * result.margin;
      if (result.margin <= options.zero) {
        result.status = ForceClosureStatus::kNotForceClosure;
        break;
      }
      if (closed || static_cast<int>(polytope.num_vertices()) >= options.max_vertices ||
          !polytope.Add(point)) {
        if (result.margin_lower > 0.0) result.status = ForceClosureStatus::kForceClosure;
        break;
      }
    }
    result.num_vertices = static_cast<int>(polytope.num_vertices());
  }
  if (result.status == ForceClosureStatus::kNotForceClosure) result.margin_lower = 0.0;
  result.direction = weakest;
  result.direction.tail<3>() *= options.length;
  return result;
}

}  // namespace dexcheck
