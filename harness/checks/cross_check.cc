#include "harness/checks/cross_check.h"

#include <algorithm>

namespace dexcheck {

CrossCheck::CrossCheck(const Setup& setup)
    : model_(setup.adapter(), setup.fingertips(), setup.scenario().control.orientation), motion_(setup) {
  if (!setup.bonds().empty()) model_.LeaveOutContacts();
}

void CrossCheck::CompareModel(const StepRecord& step) {
  const MeasuredState& state = step.reading.state;
  if (step.command.handling.partial) {
    model_.IncludeContacts(std::all_of(state.overlap.begin(), state.overlap.end(),
                                       [](double depth) { return depth > -PlantReading::kFar; }));
  }
  model_.Compare(step.model->robot(), step.model->grasp(), state, step.reading.X_W0, step.time);
}

}  // namespace dexcheck
