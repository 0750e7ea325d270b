#include "controller/grasp/growing_polytope.h"

#include <Eigen/LU>
#include <algorithm>
#include <limits>
#include <utility>

namespace dexcheck::grasp_internal {
namespace {

// Height above a facet's plane, relative to the size of the coordinates, up to which a point counts as on the
// plane.
constexpr double kFlat = 1e-11;

template <std::size_t kSize>
Vector6d CalcMean(const std::array<Vector6d, kSize>& points) {
  Vector6d sum = Vector6d::Zero();
  for (const Vector6d& point : points) sum += point;
  return sum / static_cast<double>(kSize);
}

}  // namespace

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

}  // namespace dexcheck::grasp_internal
