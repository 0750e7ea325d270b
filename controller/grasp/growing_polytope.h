#pragma once

// A convex polytope in R^6 that grows point by point. Internal to controller/grasp.

#include <array>
#include <cstddef>
#include <unordered_map>
#include <vector>

#include "controller/common/types.h"

namespace dexcheck::grasp_internal {

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

}  // namespace dexcheck::grasp_internal
