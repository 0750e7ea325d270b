#include "harness/diagnosis/force_steps.h"

#include <algorithm>
#include <map>

namespace dexcheck {

using Eigen::Index;

// Steps that are looked at, beside those at jumps: fewer of a robot with many joints; and between two jumps.
constexpr size_t kMostSteps = 20, kLeastSteps = 8, kRows = 400, kFewestBetween = 4;

ForceSteps ListForceSteps(const StepStore& store) {
  ForceSteps steps;
  std::vector<Index> differing;
  for (Index i = 0; i < store.size(); ++i) {
    const auto row = store.Row(i);
    if (store.HasForces(row) &&
        (store.Part(row, StepStore::kResidual).cwiseAbs().array() > kFails * store.CalcNoise(row).array())
            .any())
      differing.push_back(i);
  }
  if (differing.empty()) return steps;
  for (Index i = differing.front(); i <= differing.back(); ++i)
    if (store.HasForces(store.Row(i))) steps.all.push_back(i);
  const auto time = store.Get(StepStore::kTime);
  std::vector<const StepStore::Jump*> jumps;
  for (const StepStore::Jump& jump : store.jumps())
    if (jump.before[0] >= time(0, steps.all.front()) && jump.after[0] <= time(0, steps.all.back()))
      jumps.push_back(&jump);
  // Evenly over all steps, and some between any two jumps.
  std::map<double, VectorXd> rows;  // by time
  const auto add = [&](size_t first, size_t last, size_t count) {
    for (size_t k = 0; k < count && last > first; ++k) {
      const Index step = steps.all[first + (count == 1 ? 0 : k * (last - 1 - first) / (count - 1))];
      rows.emplace(time(0, step), store.Row(step));
    }
  };
  const auto entries = static_cast<size_t>(store.Get(StepStore::kResidual).rows());
  add(0, steps.all.size(), std::min(steps.all.size(), std::clamp(kRows / entries, kLeastSteps, kMostSteps)));
  size_t first = 0;
  for (size_t j = 0; j <= jumps.size() && !jumps.empty(); ++j) {
    size_t last = first;
    while (last < steps.all.size() && (j == jumps.size() || time(0, steps.all[last]) < jumps[j]->after[0]))
      ++last;
    add(first, last, kFewestBetween);
    first = last;
  }
  for (const StepStore::Jump* const jump : jumps) {
    rows.emplace(jump->before[0], jump->before);
    rows.emplace(jump->after[0], jump->after);
  }
  for (const auto& [when, row] : rows) {
    const auto jump = std::ranges::find(jumps, when, [](const auto* one) { return one->after[0]; });
    if (jump != jumps.end()) {
      steps.begins.push_back(static_cast<Index>(steps.rows.size()));
      steps.changes.push_back((*jump)->change);
    }
    steps.rows.push_back(row);
  }
  return steps;
}

}  // namespace dexcheck
