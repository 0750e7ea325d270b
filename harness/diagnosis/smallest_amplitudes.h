#pragma once

// How small a fault may be and still be named by the estimator, to first order.

#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "harness/diagnosis/cause_estimator.h"

namespace dexcheck {

/// Of one amplitude of a candidate, the others being nothing. Infinite where no size is enough.
struct SmallestAmplitude {
  size_t candidate = 0;
  Eigen::Index component = 0;
  double found = std::numeric_limits<double>::infinity();  ///< From which on SelectCauses chooses it,
  double named = std::numeric_limits<double>::infinity();  ///< and tells it from all other candidates.
  size_t rival = SIZE_MAX;  ///< The one that is told from it last; SIZE_MAX for none.
};

/// All amplitudes of all candidates. A rival of no more columns leaves |y - C_r a_r|^2 = a^2 d^2 of it; it is
/// told when the likelihoods differ by exp(kEqualLogOdds).
/// @param is_like whether two candidates are told by one name.
std::vector<SmallestAmplitude> FindSmallestAmplitudes(
    std::span<const Candidate> candidates, const CauseOptions& options,
    const std::function<bool(size_t candidate, size_t other)>& is_like);

}  // namespace dexcheck
