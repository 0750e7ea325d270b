#include "harness/checks/cross_check.h"

#include <algorithm>

namespace dexcheck {

CrossCheck::CrossCheck(const Setup& setup)
    : setup_(&setup),
      model_(setup.adapter(), setup.fingertips(), setup.scenario().control.orientation),
      motion_(setup) {
  const bool bonded = !setup.bonds().empty();
  model_.IncludeContacts(!bonded);
  const std::vector<CheckRecord> records = model_.records();
  for (size_t i = 0; i < records.size(); ++i) {
    RunCheck check;
    check.name = records[i].name;
    check.kind = records[i].kind;
    check.bound = records[i].bound;
    check.description = "model against engine at the same state, relative to the term's scale";
    check.applies = !bonded || !StepModelCheck::IsOfContacts(i);
    model_checks_.push_back(check);
  }
}

void CrossCheck::CompareModel(const StepRecord& step) {
  const MeasuredState& state = step.reading.state;
  if (step.command.handling.partial) {
    model_.IncludeContacts(std::all_of(state.overlap.begin(), state.overlap.end(),
                                       [](double depth) { return depth > -PlantReading::kFar; }));
  }
  model_.Compare(step.model->robot(), step.model->grasp(), state, step.reading.X_W0, step.step);
  const std::span<const double> errors = model_.step_errors();
  bool newly_failed = false;
  for (size_t i = 0; i < errors.size(); ++i) {
    if (StepModelCheck::IsOfContacts(i) && !model_.includes_contacts()) continue;
    const bool failed_before = model_checks_[i].failed;
    model_checks_[i].Add(errors[i], step.time);
    newly_failed = newly_failed || (model_checks_[i].failed && !failed_before);
  }
  if (!newly_failed) return;
  const std::vector<CheckRecord> records = model_.records();
  const RobotModel& model = setup_->model();
  for (size_t i = 0; i < records.size(); ++i) {
    if (records[i].failed) {
      model_checks_[i].where = Describe(records[i].first_failure, model, model.num_base_velocities());
    }
  }
}

}  // namespace dexcheck
