#include "harness/checks/cross_check.h"

#include <algorithm>
#include <cmath>

#include "harness/checks/law_terms.h"

namespace dexcheck {

CrossCheck::CrossCheck(const Setup& setup, bool knows_law)
    : setup_(&setup),
      model_(setup.adapter(), setup.fingertips(), setup.scenario().control.orientation),
      motion_(setup),
      law_terms_(setup.model().num_positions(), setup.model().num_velocities(),
                 3 * static_cast<int>(setup.fingertips().size())),
      motors_(setup.model(), setup.scenario().plant.time_step),
      sensors_(setup.model(), setup.fingertips(), setup.scenario().plant.time_step) {
  if (!setup.bonds().empty()) model_.LeaveOutContacts();
  if (!setup.scenario().task && knows_law) law_.emplace(setup);
  using enum StepCheck;
  if (!law_) {
    for (const StepCheck check : {kGains, kLawTorque, kLawDemand, kGraspForce}) motion_.LeaveOut(check);
  }
  if (law_ && !law_->has_error_dynamics()) motion_.LeaveOut(kGains);
  if (law_ && !law_->has_demand()) motion_.LeaveOut(kLawDemand);
  if (!law_ || !law_->follows_error()) {
    motion_.LeaveOut(kErrorDynamics);
    motion_.LeaveOut(kOrientationDynamics);
  }
}

void CrossCheck::Reset() {
  for (const CheckRecord& check : motion_.checks()) {
    if (check.failed) settling_failures_.push_back(check);
  }
  motion_.Reset();
}

void CrossCheck::CompareModel(const StepRecord& step) {
  const MeasuredState& state = step.reading.state;
  if (step.command.handling.partial) {
    model_.IncludeContacts(std::all_of(state.overlap.begin(), state.overlap.end(),
                                       [](double depth) { return depth > -PlantReading::kFar; }));
  }
  model_.Compare(step.model->robot(), step.model->grasp(), state, step.reading.X_W0, step.time);
}

double CrossCheck::CompareTold(const StepRecord& step) {
  const MeasuredState& told = step.told.state;
  const MeasuredState& truth = step.reading.state;
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

void CrossCheck::CompareUnsent(const StepRecord& step) {
  if (!law_ || !LawCheck::IsJudged(step)) return;
  CompareModel(step);
  motion_.Add(StepCheck::kTold, CompareTold(step), step.time);
  sensors_.Add(step.told.state, step.reading.state);
  if (!law_->has_demand()) return;  // of a baseline
  ReadEngineTerms(model_.context(), *step.model, step.told.state, setup_->bonds().empty(), &law_terms_);
  motion_.Add(StepCheck::kLawTorque, law_->CompareUnsent(step, law_terms_), step.time);
}

MeasuredCauses CrossCheck::Tell() const {
  MeasuredCauses measured;
  if (law_) measured.law = law_->attribution().Tell();
  measured.motors = motors_.Tell();
  measured.sensors = sensors_.Tell();
  measured.wheels = motion_.wheels().Tell();
  const ForceEvidence& forces = motion_.forces();
  if (!forces.has_any()) return measured;
  measured.force = forces.Tell();
  measured.is_slope = ForceEvidence::IsSlope(forces.Find(), setup_->model().gravity());
  return measured;
}

void CrossCheck::CompareLaw(const StepRecord& step) {
  const double t = step.time;
  const Expectation& expect = setup_->scenario().expect;
  motion_.Add(StepCheck::kTold, CompareTold(step), t);
  motion_.Add(StepCheck::kTorqueApplied, LawCheck::CompareApplied(step), t);
  motors_.Add(step.command.tau, step.response.motor_torques, step.reading.state.xi);
  sensors_.Add(step.told.state, step.reading.state);
  if (step.command.tracks && t >= expect.from) {
    motion_.Add(StepCheck::kExpectPosition, step.error.position.norm(), t);
    motion_.Add(StepCheck::kExpectOrientation, step.error.orientation, t);
  }
  if (!law_) return;
  motion_.Add(StepCheck::kGains, law_->sampled_radius(), t);
  if (!LawCheck::IsJudged(step)) return;
  const bool contacts = setup_->bonds().empty();
  ReadEngineTerms(model_.context(), *step.model, step.told.state, contacts, &law_terms_);
  const LawErrors& errors = law_->Compare(step, motion_.findings(), law_terms_, *motion_.mass_factor());
  motion_.Add(StepCheck::kLawTorque, errors.torque, t);
  motion_.Add(StepCheck::kLawDemand, errors.demand, t);
  motion_.Add(StepCheck::kGraspForce, errors.grasp_force, t);
  motion_.Add(StepCheck::kErrorDynamics, errors.error_dynamics, t);
  motion_.Add(StepCheck::kOrientationDynamics, errors.orientation_dynamics, t);
}

}  // namespace dexcheck
