#pragma once

// Force closure (26), decided by how large a wrench the grasp can resist in its weakest direction.

#include "controller/common/types.h"

namespace dexcheck {

enum class ForceClosureStatus {
  kForceClosure,     ///< Every wrench can be resisted: margin_lower > 0.
  kNotForceClosure,  ///< `direction` cannot be resisted at all.
  kUndecided,        ///< The margin is below what was resolved: margin_lower <= 0 < margin.
};

struct ForceClosureOptions {
  double length = 0.05;     ///< Characteristic length, m: a moment counts as the force moment / length.
  double tolerance = 0.02;  ///< Relative width of [margin_lower, margin] at which to stop.
  double zero = 1e-9;       ///< Margins up to this count as none.
  int max_vertices = 2000;  ///< Points of the inner polytope.
};

/// The largest ball of wrenches [force; moment / length] that normalised contact forces can give, sum_i f_i3
/// <= 1: the hand has one budget of normal force for all contacts. Margins are per newton of it, without
/// unit.
struct ForceClosureResult {
  ForceClosureStatus status = ForceClosureStatus::kUndecided;
  double margin = 0.0;  ///< Largest resisted wrench in `direction`: an upper bound on the ball's radius.
  double margin_lower =
      0.0;  ///< Lower bound on the radius: that of a ball inside a polytope of resisted wrenches.
  /// Weakest direction, a wrench [N; N m] in the object frame with |[force; moment / length]| = 1. No
  /// admissible normalised contact forces give more of it than `margin`.
  Vector6d direction = Vector6d::Zero();
  int num_vertices = 0;
};

/// Decides (26): G f_c = -F_e has a solution in the friction cones (21) for every F_e if and only if the set
/// of wrenches of normalised contact forces has the origin in its interior. Its largest ball is found by
/// growing a polytope inside that set, at the facet nearest to the origin, by the point of the set farthest
/// along the facet's normal [Zheng 2013]; cones are not replaced by pyramids. `G` 6 x 3N, object frame; `mu`
/// (N). Throws std::invalid_argument for sizes that differ, numbers that are not finite, mu <= 0, or options
/// out of range.
///
/// [Zheng 2013] Y. Zheng: An efficient algorithm for a grasp quality measure.
ForceClosureResult CalcForceClosure(const Eigen::Ref<const Matrix6Xd>& G,
                                    const Eigen::Ref<const VectorXd>& mu,
                                    const ForceClosureOptions& options = {});

}  // namespace dexcheck

// Whether contact forces can give wrenches in every direction: the rank of G. Internal to controller/grasp.

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
