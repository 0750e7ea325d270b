#include "harness/checks/known_plant.h"

#include "harness/checks/step_record.h"

namespace dexcheck {

KnownPlant::KnownPlant(const Setup& setup, std::span<const Motor> motors)
    : sensing_(setup.scenario().imperfections.sensing, setup.MakePartContext()),
      drive_(motors, setup.scenario().imperfections.actuation, setup.MakePartContext()),
      disturbances_(setup.scenario().imperfections.disturbances, setup.MakePartContext()),
      model_(setup.declared_model(), setup.fingertips(), setup.declared_object().body, setup.surface(),
             setup.MakeControllerOptions()) {
  known_.model = &model_;
  known_.force.setZero(setup.model().num_velocities());
}

const KnownStep& KnownPlant::Follow(const StepRecord& step) {
  const MeasuredState& truth = step.reading.state;
  sensing_.Tell(step.reading, &known_.told);
  drive_.Drive(step.command.tau, truth.xi, &known_.tau);
  model_.SetState(truth);
  known_.force.setZero();
  known_.push.setZero();
  known_.object_wrench.setZero();
  if (!disturbances_.empty()) {
    const std::span<const Wrench> wrenches = disturbances_.Evaluate(step.time, truth);
    for (const Wrench& w : wrenches) {
      if (w.body != Wrench::kObject) known_.push += w.force;
    }
    AddRobotForce(wrenches, model_.robot(), known_.force);
    known_.object_wrench = CalcObjectWrench(wrenches, truth.X_Bo);
  }
  return known_;
}

}  // namespace dexcheck
