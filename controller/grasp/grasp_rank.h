#pragma once

// Whether contact forces can give wrenches in every direction: the rank of G. Internal to controller/grasp.

#include "controller/common/types.h"

namespace dexcheck::grasp_internal {

/// Smallest ratio of singular values at which 6 x n wrenches count as spanning R^6. It lies above the
/// rounding of G, which is 1e-15 for a few products of unit size and 1e-13 behind a chain of transforms, and
/// singular values of G itself keep: those of G G^T would be lost below 1e-8. A grasp with less resists a
/// billionth of its largest wrench in some direction.
inline constexpr double kRankTolerance = 1e-9;

/// The direction in which wrenches reach least.
struct WeakestDirection {
  double ratio = 0.0;  ///< Smallest singular value over the largest; NaN for G that is not finite.
  Vector6d n = Vector6d::Unit(0);  ///< Left singular vector of the smallest.
};

/// Finds the direction that the columns of `G` (6 x n, rows in comparable units) span least. Allocates
/// nothing.
WeakestDirection FindWeakestDirection(const Eigen::Ref<const Matrix6Xd>& G);

/// Throws SingularityError with the ratio of singular values unless G (6 x n, force rows first) has full row
/// rank, moments counted per longest arm of G. Allocates nothing unless it throws.
void RequireFullRank(const Eigen::Ref<const Matrix6Xd>& G);

}  // namespace dexcheck::grasp_internal
