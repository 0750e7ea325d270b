#include "harness/diagnosis/run_causes.h"

#include <algorithm>

#include "harness/diagnosis/contact_causes.h"
#include "harness/diagnosis/force_causes.h"
#include "harness/diagnosis/law_causes.h"
#include "harness/diagnosis/rolling_causes.h"
#include "harness/diagnosis/signal_causes.h"

namespace dexcheck {
namespace {

bool Explains(const Causes& causes, CauseChannel channel) {
  return std::any_of(causes.begin(), causes.end(), [&](const Explanation& one) {
    return one.channel == channel && one.outcome != CauseOutcome::kNotExplained;
  });
}

/// Contacts that are elsewhere make object and fingers move as if something else acted on them.
void DropConsequencesOfShapes(const StepStore& store, Causes* causes) {
  if (!Explains(*causes, CauseChannel::kContact)) return;
  const RobotModel& model = store.setup().model();
  std::vector<std::string> places = {"object " + store.setup().object().name};
  const std::vector<int>& arm = store.setup().hold().arm_joints;
  for (const int tip : store.setup().fingertips()) {
    int link = model.frames()[static_cast<size_t>(tip)].link;
    for (; link >= 0; link = model.joints()[static_cast<size_t>(link)].parent)
      if (std::find(arm.begin(), arm.end(), link) == arm.end())
        places.push_back("link " + model.link_name(link));
  }
  std::erase_if(*causes, [&](const Explanation& one) {
    return one.channel == CauseChannel::kBalance &&
           std::find(places.begin(), places.end(), one.faults.front().place) != places.end();
  });
}

/// Wheels that roll otherwise make platform and wheels move as if something else acted on them.
void DropConsequences(const StepStore& store, Causes* causes) {
  if (!Explains(*causes, CauseChannel::kRolling)) return;
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
  for (const auto explain : {ExplainSignals, ExplainLaw, ExplainContacts, ExplainRolling, ExplainForces}) {
    Causes found = explain(store);
    std::move(found.begin(), found.end(), std::back_inserter(causes));
  }
  DropConsequencesOfShapes(store, &causes);
  DropConsequences(store, &causes);
  std::stable_sort(causes.begin(), causes.end(),
                   [](const Explanation& a, const Explanation& b) { return a.channel < b.channel; });
  return causes;
}

}  // namespace dexcheck
