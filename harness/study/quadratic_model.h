#pragma once

// A quadratic through the best points that a search has tried, and where it is least.

#include <optional>
#include <vector>

#include "harness/study/objective.h"
#include "harness/study/sampling.h"

namespace dexcheck {

/// A point of the unit cube, and what it came to.
struct TriedPoint {
  UnitPoint point;
  Judgement judgement;
};

/// Fits, with z from the best point in units of the points' extent,
///
///   f(z) = c + g^T z + z^T H z / 2
///
/// by least squares with weights that fall with the rank, as lq-CMA-ES does [Hansen 2019]: H is symmetric
/// where there are 1.1 points for each coefficient, else diagonal, else zero. At most two points for each
/// coefficient are used, the best. A point that is not feasible counts as worse than all that are, by its
/// violation.
/// @returns where f is least in the box around these points, widened by half its extent on each side, within
///   the cube; none when there are too few points, or when that place was tried.
std::optional<UnitPoint> FindModelMinimum(std::vector<TriedPoint> tried);

}  // namespace dexcheck
