#include "harness/checks/declared_plant.h"

#include <algorithm>

namespace dexcheck {
namespace {

/// The plant is not ideal either for a controller that follows its contacts, since these are not the true
/// ones, and for joints with dry friction, which no law here plans for.
bool IsIdeal(const Setup& setup) {
  const std::vector<Joint>& joints = setup.model().joints();
  return setup.scenario().imperfections.is_ideal() &&
         setup.scenario().control.kappa != ContactSource::kIntegrated &&
         std::ranges::none_of(joints, [](const Joint& joint) { return joint.dry_friction > 0.0; });
}

/// Whether the measured state is the declared one, from which the terms of both are the same.
bool IsSame(const MeasuredState& a, const MeasuredState& b) {
  bool same = a.q == b.q && a.xi == b.xi && a.X_Bo.matrix() == b.X_Bo.matrix() && a.V_Bo == b.V_Bo &&
              a.overlap == b.overlap;
  for (size_t i = 0; same && i < b.kappa.size(); ++i)
    same = a.kappa[i].CalcVector() == b.kappa[i].CalcVector();
  return same;
}

}  // namespace

DeclaredPlant::DeclaredPlant(const Setup& setup, std::span<const Motor> motors)
    : sensing_(setup.scenario().imperfections.sensing, setup.MakePartContext()),
      drive_(motors, setup.scenario().imperfections.actuation, setup.MakePartContext()),
      disturbances_(setup.scenario().imperfections.disturbances, setup.MakePartContext()),
      model_(setup.declared_model(), setup.fingertips(), setup.declared_object().body, setup.surface(),
             setup.MakeControllerOptions()) {
  step_.is_ideal = IsIdeal(setup);
  step_.force.setZero(setup.model().num_velocities());
}

const DeclaredStep& DeclaredPlant::Follow(const StepRecord& step) {
  const MeasuredState& state = step.reading.state;
  sensing_.Measure(step.reading, &step_.measured);
  drive_.Drive(step.command.tau, state.xi, &step_.tau);
  step_.model = step.model;
  step_.is_measured_right = IsSame(step.measured.state, step_.measured.state);
  if (step_.is_ideal && step_.is_measured_right) return step_;
  model_.SetState(state);
  step_.model = &model_;
  step_.force.setZero();
  step_.object_wrench.setZero();
  step_.pushes = {};
  if (!disturbances_.empty()) {
    const std::span<const Wrench> wrenches = disturbances_.Evaluate(step.time, state);
    AddRobotForce(wrenches, model_.robot(), step_.force);
    step_.object_wrench = CalcObjectWrench(wrenches, state.X_Bo);
    step_.pushes = disturbances_.Evaluate(step.time, step.reading);
  }
  return step_;
}

}  // namespace dexcheck
