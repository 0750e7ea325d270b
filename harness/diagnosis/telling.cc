#include "harness/diagnosis/telling.h"

namespace dexcheck {

Explanation StartExplanation(const StepStore& store, CauseChannel channel,
                             const std::vector<Eigen::Index>& steps) {
  // The last step that is kept may be one that has no answer any more.
  constexpr Eigen::Index kLast = 2;
  const auto time = store.Get(StepStore::kTime);
  Explanation start;
  start.channel = channel;
  start.from = time(0, steps.front());
  start.to = time(0, steps.back());
  start.ends = steps.back() + kLast < store.size();
  const double time_step = store.setup().scenario().plant.time_step;
  // The time between two steps that are kept, beside the one that is seen.
  const auto find_gap = [&](Eigen::Index after) {
    const double apart = time(0, after) - time(0, after - 1);
    return apart > 1.5 * time_step ? apart - time_step : 0.0;
  };
  if (steps.front() > 0) start.unseen_before = find_gap(steps.front());
  if (start.ends) start.unseen_after = find_gap(steps.back() + 1);
  return start;
}

Fault DescribeNumber(const Candidate& candidate, const VectorXd& amplitude, const VectorXd& error) {
  return {candidate.fault,
          candidate.place,
          candidate.nominal + amplitude[0],
          error.size() > 0 ? error[0] : 0.0,
          candidate.unit,
          "",
          candidate.nominal};
}

Causes DescribeSelection(const Explanation& start, const CauseSelection& selection,
                         std::span<const Candidate> candidates, const DescribeCandidate& describe,
                         bool is_explained) {
  Causes causes;
  for (const CauseTerm& term : selection.terms) {
    Explanation& one = causes.emplace_back(start);
    one.fraction = selection.terms.size() == 1 ? selection.fraction : term.fraction;
    one.left = selection.left;
    one.faults.push_back(describe(candidates[term.candidate], term.amplitude, term.error));
    for (const auto& [same, amplitude] : term.same)
      one.faults.push_back(describe(candidates[same], amplitude, {}));
    one.SetOutcome();
    if (!is_explained) one.outcome = CauseOutcome::kNotExplained;
    if (term.rival != SIZE_MAX) one.SetRival(candidates[term.rival], term.log_odds);
  }
  return causes;
}

}  // namespace dexcheck
