#include "harness/checks/cross_check.h"

#include <algorithm>
#include <cmath>

#include "harness/checks/law_terms.h"

namespace dexcheck {

CrossCheck::NotIdeal::NotIdeal(const Setup& setup, std::span<const Motor> motors)
    : plant(setup, motors),
      controller(setup.controller_side(), setup.fingertips(), setup.scenario().control.orientation),
      dynamics(setup.model(), static_cast<int>(setup.fingertips().size())),
      actuation(setup.model()) {
  // What is told of robot, object and contacts need not fit together: contacts are compared at the truth.
  controller.LeaveOutContacts();
  force.setZero(setup.model().num_velocities());
}

CrossCheck::CrossCheck(const Setup& setup, std::span<const Motor> motors)
    : setup_(&setup),
      model_(setup.plant_side(), setup.fingertips(), setup.scenario().control.orientation),
      motion_(setup),
      law_terms_(setup.model().num_positions(), setup.model().num_velocities(),
                 3 * static_cast<int>(setup.fingertips().size())) {
  if (!setup.bonds().empty()) model_.LeaveOutContacts();
  if (!setup.scenario().task) law_.emplace(setup);
  if (!setup.scenario().imperfections.is_ideal()) known_.emplace(setup, motors);
  using enum StepCheck;
  if (!law_) {
    for (const StepCheck check : {kGains, kLawTorque, kLawDemand, kGraspForce}) motion_.LeaveOut(check);
  }
  if (!law_ || !law_->follows_error()) motion_.LeaveOut(kErrorDynamics);
}

void CrossCheck::CompareModel(const StepRecord& step) {
  const MeasuredState& state = step.reading.state;
  if (step.command.handling.partial) {
    model_.IncludeContacts(std::all_of(state.overlap.begin(), state.overlap.end(),
                                       [](double depth) { return depth > -PlantReading::kFar; }));
  }
  const GraspModel& plant = ModelAtTruth(step);
  model_.Compare(plant.robot(), plant.grasp(), state, step.reading.X_W0, step.time);
  if (!known_) return;
  StepModelCheck& controller = known_->controller;
  controller.Compare(step.model->robot(), step.model->grasp(), step.told.state, step.reading.X_W0, step.time);
  model_.Merge(controller);
}

double CrossCheck::CompareTold(const StepRecord& step) {
  const MeasuredState& told = step.told.state;
  const MeasuredState& truth = step.known != nullptr ? step.known->told.state : step.reading.state;
  double apart = (told.q - truth.q).lpNorm<Eigen::Infinity>();
  apart = std::max(apart, (told.xi - truth.xi).lpNorm<Eigen::Infinity>());
  apart = std::max(apart, (told.X_Bo.matrix() - truth.X_Bo.matrix()).cwiseAbs().maxCoeff());
  apart = std::max(apart, (told.V_Bo - truth.V_Bo).lpNorm<Eigen::Infinity>());
  for (size_t i = 0; i < truth.kappa.size(); ++i) {
    apart = std::max({apart, std::abs(told.kappa[i].alpha_o.u - truth.kappa[i].alpha_o.u),
                      std::abs(told.kappa[i].alpha_o.v - truth.kappa[i].alpha_o.v)});
  }
  return apart;
}

const LawErrors& CrossCheck::CompareIdealLaw(const StepRecord& step) {
  const bool contacts = setup_->bonds().empty();
  ReadEngineTerms(model_.context(), *step.model, step.told.state, contacts, &law_terms_);
  return law_->Compare(step, motion_.findings(), law_terms_, *motion_.mass_factor());
}

const LawErrors& CrossCheck::CompareKnownLaw(const StepRecord& step) {
  NotIdeal& known = *known_;
  const GraspModel& told = *step.model;
  ReadEngineTerms(known.controller.context(), told, step.told.state, /*contacts=*/false, &law_terms_);
  known.actuation.CalcForce(step.command.tau, known.force);
  const Prediction& meant = known.dynamics.Predict(told.robot(), told.grasp(), known.force);
  known.findings.xi_dot_model = meant.xi_dot;
  known.findings.V_Bo_dot_model = meant.V_Bo_dot;
  known.findings.f_c_model = meant.f_c;
  return law_->Compare(step, known.findings, law_terms_, known.dynamics.mass_factor());
}

void CrossCheck::CompareLaw(const StepRecord& step) {
  const double t = step.time;
  const Expectation& expect = setup_->scenario().expect;
  motion_.Add(StepCheck::kTold, CompareTold(step), t);
  motion_.Add(StepCheck::kTorqueApplied, LawCheck::CompareApplied(step), t);
  if (step.command.tracks && t >= expect.from) {
    motion_.Add(StepCheck::kExpectPosition, step.error.position.norm(), t);
    motion_.Add(StepCheck::kExpectOrientation, step.error.orientation, t);
  }
  if (!law_) return;
  motion_.Add(StepCheck::kGains, law_->sampled_radius(), t);
  if (!LawCheck::IsJudged(step)) return;
  const LawErrors& errors = known_ ? CompareKnownLaw(step) : CompareIdealLaw(step);
  motion_.Add(StepCheck::kLawTorque, errors.torque, t);
  motion_.Add(StepCheck::kLawDemand, errors.demand, t);
  motion_.Add(StepCheck::kGraspForce, errors.grasp_force, t);
  motion_.Add(StepCheck::kErrorDynamics, errors.error_dynamics, t);
}

}  // namespace dexcheck
