#include "harness/checks/cross_check.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/checks/law_terms.h"

namespace dexcheck {
namespace {

/// What should have been told.
const MeasuredState& MeasuredOf(const StepRecord& step) {
  return step.known != nullptr ? step.known->told.state : step.reading.state;
}

}  // namespace

CrossCheck::NotIdeal::NotIdeal(const Setup& setup, std::span<const Motor> motors)
    : plant(setup, motors),
      controller(setup.controller_adapter(), setup.fingertips(), setup.scenario().control.orientation) {
  // What is told of robot, object and contacts need not fit together: contacts are compared at the truth.
  controller.LeaveOutContacts();
  controller.RaiseBounds(setup.scenario().tolerance);
}

CrossCheck::CrossCheck(const Setup& setup, std::span<const Motor> motors, bool knows_law)
    : setup_(&setup),
      model_(setup.plant_adapter(), setup.fingertips(), setup.scenario().control.orientation),
      motion_(setup),
      clearance_(setup.engine(), setup.plant_adapter(), setup.robots().solids, setup.robots().watched_pairs),
      kinematics_(MakeData(setup.engine())),
      law_terms_(setup.model().num_positions(), setup.model().num_velocities(),
                 3 * static_cast<int>(setup.fingertips().size())),
      motors_(setup.model(), setup.scenario().plant.time_step),
      sensors_(setup.model(), setup.fingertips(), setup.scenario().plant.time_step),
      meant_dynamics_(setup.model(), static_cast<int>(setup.fingertips().size())),
      actuation_(setup.model()),
      meant_force_(VectorXd::Zero(setup.model().num_velocities())) {
  if (!setup.start().bonds.empty()) model_.LeaveOutContacts();
  model_.RaiseBounds(setup.scenario().tolerance);
  if (setup.joints() != nullptr && knows_law) {
    joint_law_.emplace(setup);
  } else if (setup.scenario().pick_task() == nullptr && knows_law) {
    law_.emplace(setup);
  }
  // A controller that follows its contacts has others than the truth, too.
  const bool follows = setup.scenario().control.kappa == ContactSource::kIntegrated;
  // And joints with dry friction do not do what any law here plans.
  const std::vector<Joint>& joints = setup.model().joints();
  const bool has_friction =
      std::any_of(joints.begin(), joints.end(), [](const Joint& joint) { return joint.dry_friction > 0.0; });
  if (follows || has_friction || !setup.scenario().imperfections.is_ideal()) known_.emplace(setup, motors);
  using enum StepCheck;
  if (joint_law_ && !joint_law_->has_error_dynamics()) motion_.LeaveOut(kSpectralRadius);
  if (joint_law_ && !joint_law_->follows_error()) motion_.LeaveOut(kJointDynamics);
  if (joint_law_) return;
  if (!law_) {
    for (const StepCheck check : {kSpectralRadius, kLawTorque, kLawDemand, kGraspNullSpace, kGraspCone,
                                  kGraspOptimality, kJointDynamics}) {
      motion_.LeaveOut(check);
    }
  }
  if (law_ && !law_->has_error_dynamics()) motion_.LeaveOut(kSpectralRadius);
  if (law_ && !law_->has_demand()) motion_.LeaveOut(kLawDemand);
  if (!law_ || !law_->follows_error()) {
    motion_.LeaveOut(kErrorDynamics);
    motion_.LeaveOut(kOrientationDynamics);
  }
}

void CrossCheck::Expect(const DisturbanceOptions& disturbance, std::span<const Motor> motors) {
  if (!known_) known_.emplace(*setup_, motors);
  known_->plant.Expect(disturbance, setup_->MakePartContext());
  motion_.LeaveOut(StepCheck::kIdleJoints);
}

void CrossCheck::Reset() {
  for (const CheckRecord& check : motion_.checks()) {
    if (check.failed) settling_failures_.push_back(check);
  }
  motion_.Reset();
  clearance_.Restart();
}

void CrossCheck::CompareSettling(const StepRecord& step) {
  CompareMotion(step);
  CompareMotors(step);
  CheckClearance(step);
}

void CrossCheck::Forget() { motion_.Reset(); }

void CrossCheck::CompareModel(const StepRecord& step) {
  const MeasuredState& state = step.reading.state;
  if (step.command.handling.partial) {
    model_.IncludeContacts(std::all_of(state.overlap.begin(), state.overlap.end(),
                                       [](double depth) { return depth > -PlantReading::kFar; }));
  }
  const GraspModel& plant = ModelAtTrueState(step);
  model_.Compare(plant.robot(), plant.grasp(), state, step.reading.X_W0, step.time);
  CheckClearance(step);
  if (!known_) return;
  StepModelCheck& controller = known_->controller;
  controller.Compare(step.model->robot(), step.model->grasp(), step.told.state, step.reading.X_W0, step.time);
  model_.Merge(controller);
}

void CrossCheck::CheckClearance(const StepRecord& step) {
  if (clearance_.pairs().empty()) return;
  const PlantReading& reading = step.reading;
  if (reading.body_positions.size() > 0) {
    clearance_.Update({reading.body_positions.data(), reading.body_rotations.data()}, step.time);
  } else {
    std::copy_n(reading.qpos.data(), reading.qpos.size(), kinematics_->qpos);
    mj_kinematics(&setup_->engine(), kinematics_.get());
    clearance_.Update({kinematics_->xpos, kinematics_->xmat}, step.time);
  }
  const std::pair<double, int> deepest = clearance_.FindDeepest();
  motion_.Add(StepCheck::kClearance, deepest.first, step.time,
              [&] { return clearance_.Describe(deepest.second); });
  const Collision& collision = step.response.collision;
  motion_.Add(StepCheck::kCollision, collision.force, step.time,
              [&] { return clearance_.DescribeGeoms(collision.geom1, collision.geom2); });
}

double CrossCheck::CompareMeasurement(const StepRecord& step) {
  const MeasuredState& told = step.told.state;
  const MeasuredState& truth = MeasuredOf(step);
  const Touch& touch = step.known != nullptr ? step.known->told.touch : step.reading.touch;
  double apart = std::abs(step.told.touch.support_force - touch.support_force);
  if (step.told.touch.fingertips != touch.fingertips) apart = std::numeric_limits<double>::infinity();
  apart = std::max(apart, (told.q - truth.q).lpNorm<Eigen::Infinity>());
  apart = std::max(apart, (told.xi - truth.xi).lpNorm<Eigen::Infinity>());
  apart = std::max(apart, (told.X_Bo.matrix() - truth.X_Bo.matrix()).cwiseAbs().maxCoeff());
  apart = std::max(apart, (told.V_Bo - truth.V_Bo).lpNorm<Eigen::Infinity>());
  for (size_t i = 0; i < truth.kappa.size(); ++i) {
    apart = std::max({apart, std::abs(told.kappa[i].alpha_o.u - truth.kappa[i].alpha_o.u),
                      std::abs(told.kappa[i].alpha_o.v - truth.kappa[i].alpha_o.v)});
  }
  return apart;
}

bool CrossCheck::MovedAsMeant(const StepRecord& step) const {
  return !known_ && step.drive.tau == step.command.tau && step.response.stop_force.size() == 0;
}

void CrossCheck::FindMeant(const StepRecord& step) {
  actuation_.CalcForce(step.command.tau, meant_force_);
  if (joint_law_) {
    meant_.xi_dot_model = meant_dynamics_.PredictFree(step.model->robot(), meant_force_).xi_dot;
    return;
  }
  // Rates that are told need not fit together: what (47), (55) plan for is xi_c, nearest to xi without slip.
  // With C_bar' xi_c and J_dot xi_c in (48), (46) the rigid system does exactly what is demanded.
  meant_force_ -= law_->reference().slip_coriolis();
  slip_acceleration_ = -law_->reference().slip_rates();
  const Prediction& meant = meant_dynamics_.Predict(step.model->robot(), step.model->grasp(), meant_force_,
                                                    ObjectSupport::kHand, &slip_acceleration_);
  meant_.xi_dot_model = meant.xi_dot;
  meant_.V_Bo_dot_model = meant.V_Bo_dot;
  meant_.f_c_model = meant.f_c;
}

void CrossCheck::ReadControllersTerms(const StepRecord& step) {
  const StepModelCheck& controller = known_ ? known_->controller : model_;
  const bool contacts = setup_->start().bonds.empty() && !known_;
  ReadEngineTerms(controller.engine(), *step.model, step.told.state, contacts, &law_terms_);
}

const LawErrors& CrossCheck::CompareControl(const StepRecord& step) {
  ReadControllersTerms(step);
  law_->Evaluate(step, law_terms_);
  if (MovedAsMeant(step)) {
    return law_->Compare(step, motion_.findings(), law_terms_, *motion_.mass_factor(), /*knows_slip=*/false);
  }
  FindMeant(step);
  return law_->Compare(step, meant_, law_terms_, meant_dynamics_.mass_factor(), /*knows_slip=*/true);
}

void CrossCheck::CompareUnsent(const StepRecord& step) {
  if (joint_law_ && step.command.computes_joints) {
    CompareModel(step);
    motion_.Add(StepCheck::kMeasurement, CompareMeasurement(step), step.time);
    sensors_.Add(step.told.state, MeasuredOf(step));
    ReadControllersTerms(step);
    motion_.Add(StepCheck::kLawTorque, joint_law_->CompareUnsent(step, law_terms_), step.time);
  }
  if (!law_ || !LawCheck::IsJudged(step)) return;
  CompareModel(step);
  motion_.Add(StepCheck::kMeasurement, CompareMeasurement(step), step.time);
  sensors_.Add(step.told.state, MeasuredOf(step));
  ReadControllersTerms(step);
  motion_.Add(StepCheck::kLawTorque, law_->CompareUnsent(step, law_terms_), step.time);
}

MeasuredCauses CrossCheck::Tell() const {
  MeasuredCauses measured;
  if (law_) measured.law = law_->attribution().Tell();
  if (joint_law_) measured.law = joint_law_->Tell();
  measured.motors = motors_.Tell();
  measured.sensors = sensors_.Tell();
  measured.wheels = motion_.wheels().Tell();
  measured.position_by_law = position_by_law_;
  measured.orientation_by_law = orientation_by_law_;
  measured.is_ideal = !known_;
  const ForceEvidence& forces = motion_.forces();
  if (!forces.has_any()) return measured;
  measured.force = forces.Tell();
  measured.is_slope = ForceEvidence::IsSlope(forces.Find(), setup_->model().gravity());
  return measured;
}

void CrossCheck::CompareJointLaw(const StepRecord& step) {
  const double t = step.time;
  motion_.Add(StepCheck::kSpectralRadius, joint_law_->sampled_radius(), t);
  if (!step.command.computes_joints) return;
  ReadControllersTerms(step);
  const bool as_meant = MovedAsMeant(step);
  if (!as_meant) FindMeant(step);
  const VectorXd& meant = as_meant ? motion_.findings().xi_dot_model : meant_.xi_dot_model;
  const JointLawErrors& errors = joint_law_->Compare(step, meant, law_terms_);
  motion_.Add(StepCheck::kLawTorque, errors.torque, t);
  motion_.Add(StepCheck::kJointDynamics, errors.error_dynamics, t);
}

void CrossCheck::CompareMotors(const StepRecord& step) {
  motion_.Add(StepCheck::kTorqueApplied, LawCheck::CompareApplied(step), step.time);
  motors_.Add(step.known != nullptr ? step.known->tau : step.command.tau, step.response.motor_torques,
              step.reading.state.xi);
}

void CrossCheck::CompareLaw(const StepRecord& step) {
  const double t = step.time;
  const Expectation& expect = setup_->scenario().expect;
  motion_.Add(StepCheck::kMeasurement, CompareMeasurement(step), t);
  CompareMotors(step);
  sensors_.Add(step.told.state, MeasuredOf(step));
  if (law_) motion_.Add(StepCheck::kSpectralRadius, law_->sampled_radius(), t);
  if (law_ && LawCheck::IsJudged(step)) CompareObjectLaw(step);
  if (step.command.tracks && t >= expect.from) {
    motion_.AddLess(StepCheck::kExpectPosition, step.error.position.norm(), position_by_hold_, t);
    motion_.AddLess(StepCheck::kExpectOrientation, step.error.orientation, orientation_by_hold_, t);
  }
  if (step.command.joints.q.size() > 0 && t >= expect.from) {
    motion_.Add(StepCheck::kExpectJoints, step.error.joints, t);
  }
  if (joint_law_) CompareJointLaw(step);
}

void CrossCheck::CompareObjectLaw(const StepRecord& step) {
  const double t = step.time;
  const LawErrors& errors = CompareControl(step);
  motion_.Add(StepCheck::kLawTorque, errors.torque, t);
  motion_.Add(StepCheck::kLawDemand, errors.demand, t);
  motion_.Add(StepCheck::kGraspNullSpace, errors.grasp_null_space, t);
  motion_.Add(StepCheck::kGraspCone, errors.grasp_cone, t);
  motion_.Add(StepCheck::kGraspOptimality, errors.grasp_optimality, t);
  motion_.Add(StepCheck::kErrorDynamics, errors.error_dynamics, t);
  motion_.Add(StepCheck::kOrientationDynamics, errors.orientation_dynamics, t);
  position_by_hold_ = errors.position_by_hold;
  orientation_by_hold_ = errors.orientation_by_hold;
  if (!law_->follows_error() || t < setup_->scenario().expect.from) return;
  position_by_law_ = std::max(position_by_law_, errors.position_by_law);
  orientation_by_law_ = std::max(orientation_by_law_, errors.orientation_by_law);
}

}  // namespace dexcheck
