#include "harness/diagnosis/run_causes.h"

#include <algorithm>

#include "harness/diagnosis/signal_causes.h"
#include "harness/diagnosis/step_forces.h"

namespace dexcheck {
namespace {

/// Contacts that are elsewhere are told by their shapes.
void DropConsequencesOfShapes(Causes* causes) {
  std::erase_if(*causes, [](const Explanation& one) {
    return one.channel == CauseChannel::kBalance && !one.faults.empty() &&
           one.faults.front().fault == force_fault::kContact;
  });
}

/// Wheels that roll otherwise make platform and wheels move as if something else acted on them.
void DropConsequences(const StepStore& store, Causes* causes) {
  if (std::none_of(causes->begin(), causes->end(), [](const Explanation& one) {
        return one.channel == CauseChannel::kRolling && one.outcome != CauseOutcome::kNotExplained;
      }))
    return;
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

Causes ExplainRun(const StepStore& store, double void_from) {
  Causes causes;
  const auto add = [&](Causes (*explain)(const StepStore&), const StepStore& from) {
    Causes found = explain(from);
    std::move(found.begin(), found.end(), std::back_inserter(causes));
  };
  for (const auto explain : {ExplainSignals, ExplainLaw, ExplainContacts}) add(explain, store);
  const StepStore before = store.GetBefore(void_from);
  for (const auto explain : {ExplainRolling, ExplainForces}) add(explain, before);
  DropConsequencesOfShapes(&causes);
  DropConsequences(store, &causes);
  std::stable_sort(causes.begin(), causes.end(),
                   [](const Explanation& a, const Explanation& b) { return a.channel < b.channel; });
  return causes;
}

}  // namespace dexcheck
