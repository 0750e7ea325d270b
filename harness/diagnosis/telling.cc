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
  return start;
}

Causes TellSelection(const Explanation& start, const CauseSelection& selection,
                     std::span<const Candidate> candidates, const TellCandidate& tell) {
  Causes causes;
  for (const CauseTerm& term : selection.terms) {
    Explanation& one = causes.emplace_back(start);
    one.fraction = selection.terms.size() == 1 ? selection.fraction : term.fraction;
    one.left = selection.left;
    one.faults.push_back(tell(candidates[term.candidate], term.amplitude, term.error));
    for (const auto& [same, amplitude] : term.same)
      one.faults.push_back(tell(candidates[same], amplitude, {}));
    one.SetOutcome();
    if (term.rival != SIZE_MAX) one.SetRival(candidates[term.rival], term.log_odds);
  }
  return causes;
}

}  // namespace dexcheck
