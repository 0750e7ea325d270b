#pragma once

// The faults that a law may have as candidates of an explanation.

#include <vector>

#include "harness/diagnosis/cause_estimator.h"
#include "harness/diagnosis/law_fit.h"

namespace dexcheck {

/// The candidates of a law: its faults at their places, with their columns in the steps that are fitted and
/// in the others. Of a fault whose sizes were searched the column is what it changes.
class LawCandidates {
 public:
  /// @param problem outlives this.
  LawCandidates(const StepStore& store, const LawProblem& problem);

  [[nodiscard]] const std::vector<Candidate>& candidates() const { return candidates_; }
  /// The fault that each candidate is; a linear one has sizes of 1.
  [[nodiscard]] const std::vector<LawTerm>& terms() const { return terms_; }
  /// All faults; of those whose sizes are searched also such that are no candidates.
  [[nodiscard]] const std::vector<LawEntry>& entries() const { return entries_; }

  /// Whether a fault can have its sizes.
  [[nodiscard]] static bool CanBe(const LawTerm& term);
  /// The candidate that such a fault is, with its sizes; a new one where there is none.
  size_t Find(const LawTerm& term);

 private:
  void Add(const LawTerm& term, MatrixXd columns);
  void AddLinear(const LawEntry& entry);
  /// A sum of which all but one summand vanish, and what is a factor of a part that the law has anyway, are
  /// no candidates besides those.
  void DropRepeated();
  /// Adds faults whose sizes are to be searched: from all starts in a few steps, then the likeliest in all.
  void AddFitted();

  const LawProblem& problem_;
  std::vector<LawPlace> places_;
  std::vector<LawEntry> entries_;
  VectorXd y_;
  std::vector<Candidate> candidates_;
  std::vector<LawTerm> terms_;
};

}  // namespace dexcheck
