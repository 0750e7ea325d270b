#include "harness/diagnosis/run_causes.h"

#include <algorithm>

#include "harness/diagnosis/force_causes.h"
#include "harness/diagnosis/law_causes.h"
#include "harness/diagnosis/rolling_causes.h"
#include "harness/diagnosis/signal_causes.h"

namespace dexcheck {

Causes ExplainRun(const StepStore& store) {
  Causes causes;
  for (const auto explain : {ExplainSignals, ExplainLaw, ExplainRolling, ExplainForces}) {
    Causes found = explain(store);
    std::move(found.begin(), found.end(), std::back_inserter(causes));
  }
  std::stable_sort(causes.begin(), causes.end(),
                   [](const Explanation& a, const Explanation& b) { return a.channel < b.channel; });
  return causes;
}

}  // namespace dexcheck
