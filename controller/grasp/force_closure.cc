#include "controller/grasp/force_closure.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <unordered_map>
#include <utility>
#include <vector>

#include "controller/common/errors.h"

namespace dexcheck {
namespace {

/// Convex hull of points in R^6, kept as simplicial facets with their neighbours and extended by the
/// beneath-beyond method.
class GrowingPolytope {
 public:
  static constexpr std::size_t kDimension = 6;

  struct Facet {
    std::array<int, kDimension> vertices;
    std::array<int, kDimension> neighbors;  ///< neighbors[k] shares all vertices but vertices[k]
    Vector6d normal;                        ///< outward, unit length
    double offset = 0.0;  ///< n^T v on the facet: the signed distance of its plane from the origin
    bool alive = true;
  };

  /// Starts from a simplex: seven points that span R^6.
  explicit GrowingPolytope(const std::array<Vector6d, kDimension + 1>& simplex);

  /// The facet whose plane is closest to the origin, or the farthest beyond it (most negative offset).
  const Facet& FindNearestFacet() const;

  /// Extends the hull by `point`; false if it lies inside, up to rounding.
  bool Add(const Vector6d& point);

  std::size_t num_vertices() const { return points_.size(); }

 private:
  using Ridge = std::array<int, kDimension - 1>;
  struct RidgeHash {
    std::size_t operator()(const Ridge& ridge) const;
  };

  int AddFacet(const std::array<int, kDimension>& vertices);
  void Link(int facet);

  std::vector<Vector6d> points_;
  std::vector<Facet> facets_;
  std::vector<int> free_;  // dead facets, to be reused
  Vector6d inside_;
  std::unordered_map<Ridge, int, RidgeHash> open_ridges_;
};

// Height above a facet's plane, relative to the size of the coordinates, up to which a point counts as on the
// plane.
constexpr double kFlat = 1e-11;

template <std::size_t kSize>
Vector6d CalcMean(const std::array<Vector6d, kSize>& points) {
  Vector6d sum = Vector6d::Zero();
  for (const Vector6d& point : points) sum += point;
  return sum / static_cast<double>(kSize);
}

std::size_t GrowingPolytope::RidgeHash::operator()(const Ridge& ridge) const {
  std::size_t hash = 0;
  for (const int v : ridge) hash = hash * 1000003u + static_cast<std::size_t>(v);
  return hash;
}

GrowingPolytope::GrowingPolytope(const std::array<Vector6d, kDimension + 1>& simplex)
    : points_(simplex.begin(), simplex.end()), inside_(CalcMean(simplex)) {
  for (std::size_t left_out = 0; left_out <= kDimension; ++left_out) {
    std::array<int, kDimension> vertices;
    for (std::size_t k = 0; k < kDimension; ++k) vertices[k] = static_cast<int>(k < left_out ? k : k + 1);
    Link(AddFacet(vertices));
  }
}

// The normal solves n^T (v_k - v_0) = 0 for all k.
int GrowingPolytope::AddFacet(const std::array<int, kDimension>& vertices) {
  Facet facet;
  facet.vertices = vertices;
  facet.neighbors.fill(-1);
  const Vector6d& v0 = points_[static_cast<std::size_t>(vertices[0])];
  Eigen::Matrix<double, 5, 6> edges;
  for (std::size_t k = 1; k < kDimension; ++k) {
    edges.row(static_cast<Eigen::Index>(k) - 1) =
        (points_[static_cast<std::size_t>(vertices[k])] - v0).transpose();
  }
  Eigen::FullPivLU<Eigen::Matrix<double, 5, 6>> lu(edges);
  lu.setThreshold(0.0);
  facet.normal = lu.kernel().col(0).normalized();
  if (facet.normal.dot(v0 - inside_) < 0.0) facet.normal = -facet.normal;
  facet.offset = facet.normal.dot(v0);

  if (free_.empty()) {
    facets_.push_back(facet);
    return static_cast<int>(facets_.size()) - 1;
  }
  const int slot = free_.back();
  free_.pop_back();
  facets_[static_cast<std::size_t>(slot)] = facet;
  return slot;
}

// Joins each open ridge of `facet` to the facet that waits for it, or lets it wait.
void GrowingPolytope::Link(int index) {
  Facet& facet = facets_[static_cast<std::size_t>(index)];
  for (std::size_t k = 0; k < kDimension; ++k) {
    if (facet.neighbors[k] >= 0) continue;
    Ridge ridge;
    std::copy_if(facet.vertices.begin(), facet.vertices.end(), ridge.begin(),
                 [&](int v) { return v != facet.vertices[k]; });
    std::ranges::sort(ridge);
    const auto [found, inserted] = open_ridges_.try_emplace(ridge, index);
    if (inserted) continue;
    const int other = found->second;
    open_ridges_.erase(found);
    facet.neighbors[k] = other;
    Facet& neighbor = facets_[static_cast<std::size_t>(other)];
    for (std::size_t j = 0; j < kDimension; ++j) {
      if (std::ranges::find(ridge, neighbor.vertices[j]) == ridge.end()) neighbor.neighbors[j] = index;
    }
  }
}

const GrowingPolytope::Facet& GrowingPolytope::FindNearestFacet() const {
  const auto distance = [](const Facet& facet) {
    return facet.alive ? facet.offset : std::numeric_limits<double>::infinity();
  };
  return *std::ranges::min_element(facets_,
                                   [&](const Facet& a, const Facet& b) { return distance(a) < distance(b); });
}

bool GrowingPolytope::Add(const Vector6d& point) {
  // The facets that see the point are removed; their outline is joined to it.
  const double flat = kFlat * (1.0 + point.lpNorm<Eigen::Infinity>());
  std::vector<int> visible;
  for (std::size_t f = 0; f < facets_.size(); ++f) {
    Facet& facet = facets_[f];
    if (!facet.alive || facet.normal.dot(point) <= facet.offset + flat) continue;
    facet.alive = false;
    visible.push_back(static_cast<int>(f));
  }
  if (visible.empty()) return false;

  const int apex = static_cast<int>(points_.size());
  points_.push_back(point);
  std::vector<std::pair<std::array<int, kDimension>, int>> cone;  // vertices, neighbour beyond the outline
  for (const int v : visible) {
    const Facet& facet = facets_[static_cast<std::size_t>(v)];
    for (std::size_t k = 0; k < kDimension; ++k) {
      if (!facets_[static_cast<std::size_t>(facet.neighbors[k])].alive) continue;
      std::array<int, kDimension> vertices = facet.vertices;
      vertices[k] = apex;
      cone.emplace_back(vertices, facet.neighbors[k]);
    }
  }
  free_.insert(free_.end(), visible.begin(), visible.end());
  for (const auto& [vertices, beyond] : cone) {
    const int index = AddFacet(vertices);
    Facet& facet = facets_[static_cast<std::size_t>(index)];
    Facet& neighbor = facets_[static_cast<std::size_t>(beyond)];
    const std::size_t k = static_cast<std::size_t>(std::ranges::find(vertices, apex) - vertices.begin());
    facet.neighbors[k] = beyond;
    for (std::size_t j = 0; j < kDimension; ++j) {
      if (std::ranges::find(vertices, neighbor.vertices[j]) == vertices.end()) neighbor.neighbors[j] = index;
    }
    Link(index);
  }
  return true;
}

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

namespace dexcheck::grasp_internal {
namespace {

// FindWeakestDirection with the last three rows divided by `arm`.
WeakestDirection FindWeakest(const Eigen::Ref<const Matrix6Xd>& G, double arm) {
  WeakestDirection weakest;
  if (!G.allFinite()) {
    weakest.ratio = std::numeric_limits<double>::quiet_NaN();
    return weakest;
  }
  Vector6d factor = Vector6d::Ones();
  factor.tail<3>() /= arm;
  const double size = G.size() == 0 ? 0.0 : (factor.asDiagonal() * G).cwiseAbs().maxCoeff();
  if (size == 0.0) return weakest;
  factor /= size;

  // G^T = Q R, three columns of G at a time; R^T has the left singular vectors and the singular values of G.
  constexpr Eigen::Index kBlock = 3;
  Eigen::Matrix<double, 6 + kBlock, 6> stack = Eigen::Matrix<double, 6 + kBlock, 6>::Zero();
  for (Eigen::Index column = 0; column < G.cols(); column += kBlock) {
    stack.bottomRows<kBlock>().setZero();
    const Eigen::Index count = std::min(kBlock, G.cols() - column);
    stack.middleRows(6, count).noalias() = G.middleCols(column, count).transpose() * factor.asDiagonal();
    const Eigen::HouseholderQR<Eigen::Matrix<double, 6 + kBlock, 6>> qr(stack);
    stack.topRows<6>() = qr.matrixQR().topRows<6>().triangularView<Eigen::Upper>();
  }
  const Eigen::JacobiSVD<Matrix6d> svd(stack.topRows<6>().transpose(), Eigen::ComputeFullU);
  weakest.ratio = svd.singularValues()[5] / svd.singularValues()[0];
  weakest.n = svd.matrixU().col(5);
  return weakest;
}

}  // namespace

WeakestDirection FindWeakestDirection(const Eigen::Ref<const Matrix6Xd>& G) { return FindWeakest(G, 1.0); }

void RequireFullRank(const Eigen::Ref<const Matrix6Xd>& G) {
  const double arm = G.size() == 0 ? 0.0 : G.bottomRows<3>().colwise().norm().maxCoeff();
  const double ratio = FindWeakest(G, arm > 0.0 ? arm : 1.0).ratio;
  if (ratio > kRankTolerance) return;
  throw SingularityError(
      "G: must have full row rank, got the ratio of singular values " + FormatNumber(ratio), ratio);
}

}  // namespace dexcheck::grasp_internal
