#include "harness/diagnosis/run_causes.h"

#include <algorithm>

#include "harness/diagnosis/force_causes.h"
#include "harness/diagnosis/law_causes.h"
#include "harness/diagnosis/rolling_causes.h"
#include "harness/diagnosis/signal_causes.h"

namespace dexcheck {
namespace {

/// Wheels that roll otherwise make platform and wheels move as if something else acted on them.
void DropConsequences(const StepStore& store, Causes* causes) {
  const auto rolls = [](const Explanation& one) {
    return one.channel == CauseChannel::kRolling && one.outcome != CauseOutcome::kNotExplained;
  };
  if (std::none_of(causes->begin(), causes->end(), rolls)) return;
  const Base& base = store.setup().model().base();
  const std::string places[] = {"link " + base.link, "joint " + base.wheel_joint_right,
                                "joint " + base.wheel_joint_left};
  std::erase_if(*causes, [&](const Explanation& one) {
    if (one.channel != CauseChannel::kBalance) return false;
    const std::string& place = one.faults.front().place;
    return place.starts_with("wheel") ||
           std::find(std::begin(places), std::end(places), place) != std::end(places);
  });
}

}  // namespace

Causes ExplainRun(const StepStore& store) {
  Causes causes;
  for (const auto explain : {ExplainSignals, ExplainLaw, ExplainRolling, ExplainForces}) {
    Causes found = explain(store);
    std::move(found.begin(), found.end(), std::back_inserter(causes));
  }
  DropConsequences(store, &causes);
  std::stable_sort(causes.begin(), causes.end(),
                   [](const Explanation& a, const Explanation& b) { return a.channel < b.channel; });
  return causes;
}

}  // namespace dexcheck
