#pragma once

// Faults of a law that act on each other: the effect of both is not the sum of their effects.

#include <vector>

#include "harness/diagnosis/law_candidates.h"

namespace dexcheck {

/// Faults that explain the differences together.
struct LawExplanation {
  std::vector<LawTerm> terms;
  /// By term, what would do in its place.
  std::vector<std::vector<LawTerm>> same;
  double left = 0.0;  ///< Mean square of the remainder.

  /// The faults and their numbers.
  [[nodiscard]] Eigen::Index CalcCost() const;
};

/// Whether faults explain the differences. @param left mean square of what they leave of those that are
/// fitted. @param aside what they leave of the others.
bool IsExplained(const LawProblem& problem, const std::vector<LawTerm>& faults, double left,
                 const VectorXd& aside);

/// Looks for the fewest faults, three at the most, of which one is beside the other in the law: all are
/// fitted together. @return without terms where none explains the differences at a lower cost.
LawExplanation FindLawFaults(const LawProblem& problem, const LawCandidates& all, Eigen::Index cost);

}  // namespace dexcheck
