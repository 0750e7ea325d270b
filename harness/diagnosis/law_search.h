#pragma once

// The faults of a law that explain its differences. Those that act on each other are fitted together: the
// effect of both is not the sum of their effects.

#include <span>
#include <vector>

#include "harness/diagnosis/law_fit.h"

namespace dexcheck {

/// Faults that explain the differences together.
struct LawExplanation {
  std::vector<LawTerm> terms;
  /// By term, what would do in its place.
  std::vector<std::vector<LawTerm>> same;
  double left = 0.0;       ///< Mean square of the remainder.
  bool is_enough = false;  ///< Whether that is no more than noise, in the steps that are set aside, too.
};

/// Looks for the fewest faults, three at the most, each at one of these places or of all torques. @return the
/// one that leaves least where none explains the differences.
LawExplanation FindLawFaults(const LawProblem& problem, std::span<const LawEntry> entries,
                             std::span<const LawPlace> places);

}  // namespace dexcheck
