#include "controller/control/trajectory_controller.h"

#include <chrono>
#include <stdexcept>

#include "controller/common/errors.h"
#include "controller/contact/contact_geometry.h"

namespace dexcheck {

void RequireGraspForce(const GraspForceResult& result) {
  if (result.status == GraspForceStatus::kOptimal) return;
  throw GraspForceError(result.status == GraspForceStatus::kInfeasible
                            ? "no contact forces inside the friction cones hold the object"
                            : "the grasp-force problem did not converge");
}

GraspForceStage::GraspForceStage(int num_contacts, const GraspControllerOptions& options)
    : problem_(num_contacts), solver_(num_contacts, options.force) {
  problem_.mu.setConstant(options.mu);
  problem_.f_max.setConstant(options.f_max);
}

const VectorXd& GraspForceStage::Solve(const GraspTerms& grasp, const Vector6d& F_o, double f_min) {
  if (!F_o.allFinite()) throw GraspForceError("the demanded forces are not finite");
  problem_.G = grasp.G();
  problem_.F_o = F_o;
  problem_.f_min.setConstant(f_min);
  const auto begin = std::chrono::steady_clock::now();
  const GraspForceResult& result = solver_.Solve(problem_);
  seconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  RequireGraspForce(result);
  return result.f_c;
}

GraspController::GraspController(const RobotModel& model, std::span<const int> fingertips,
                                 const MassProperties& object, const Surface& surface,
                                 const GraspControllerOptions& options)
    : options_(options),
      model_(model, fingertips, object, surface, options),
      law_(model, static_cast<int>(fingertips.size()), options.weight),
      force_(static_cast<int>(fingertips.size()), options) {
  sigma_prime_.setZero(model.num_velocities());
  F_N_.setZero(grasp().num_forces());
  if (options.law != ControlLaw::kComputedTorque) {
    baseline_.emplace(
        model, static_cast<int>(fingertips.size()), options.law,
        BaselineLaw::Options{options.gains, options.orientation, options.weight, options.stiffness});
  }
}

void GraspController::SetState(const MeasuredState& state) {
  model_.SetState(state);
  options_.posture.CalcAcceleration(state.q, state.xi, sigma_prime_);
}

const VectorXd& GraspController::CalcTorque(const DesiredMotion& desired) {
  if (baseline_) {
    baseline_->SetDemand(robot(), grasp(), desired, sigma_prime_);
    V_Bo_dot_ = baseline_->V_Bo_dot();
    law_.SetForces(grasp(), baseline_->F_o(), baseline_->force(), baseline_->xi_dot_d());
  } else {
    V_Bo_dot_ = CalcTrackingAcceleration(options_.gains, options_.orientation, grasp(), desired);
    law_.SetDemand(robot(), grasp(), V_Bo_dot_, sigma_prime_);
  }

  if (!law_.tau_0().allFinite()) throw GraspForceError("the demanded forces are not finite");
  // F_N = f_c - G^+ F_o, so that (49) gives f_c back
  law_.CalcInternalForce(force_.Solve(grasp(), law_.F_o(), options_.f_min), F_N_);
  return law_.CalcTorque(grasp(), F_N_);
}

ContactFollower::ContactFollower(const RobotModel& model, std::span<const int> fingertips,
                                 const Surface& surface, const StateTiming& timing)
    : robot_(model, Coordinates::kReduced),
      fingertips_(fingertips.begin(), fingertips.end()),
      surface_(&surface),
      timing_(timing),
      kappa_(fingertips.size()),
      last_(fingertips.size()) {
  Require(timing.time_step > 0.0, "time step [s]", "must be positive", timing.time_step);
  for (const int frame : fingertips_) tips_.emplace_back(model.tip_radius(frame));
  J_f_.setZero(6, model.num_velocities());
  J_f_dot_ = J_f_;
}

ContactFollower::Velocities ContactFollower::CalcVelocities(const MeasuredState& state, size_t finger) {
  robot_.CalcFrameJacobian(fingertips_[finger], J_f_, J_f_dot_);
  Velocities now;
  now.V_f.noalias() = J_f_ * state.xi;
  now.V_Bo = state.V_Bo;
  if (timing_.velocity_age > 0.0) {
    // xi, p_dot and omega are those of the middle of the step; J_f and R^T, at its end, go back to there.
    now.V_f.noalias() -= timing_.velocity_age * (J_f_dot_ * state.xi);
    const Vector3d v = state.V_Bo.head<3>();
    const Vector3d omega = state.V_Bo.tail<3>();
    now.V_Bo.head<3>() += timing_.velocity_age * omega.cross(v);
    return now;
  }
  Velocities middle{0.5 * (last_[finger].V_f + now.V_f), 0.5 * (last_[finger].V_Bo + now.V_Bo)};
  last_[finger] = now;
  return middle;
}

const std::vector<ContactCoordinates>& ContactFollower::Follow(const MeasuredState& state) {
  robot_.SetState(state.q, state.xi);
  for (size_t i = 0; i < kappa_.size(); ++i) {
    const Velocities middle = CalcVelocities(state, i);
    if (!has_begun_) {
      kappa_[i] = state.kappa[i];
      continue;
    }
    const auto twist = [&](double /*t*/, const ContactGeometry& contact) {
      return CalcRelativeTwist(contact, middle.V_f, middle.V_Bo);
    };
    kappa_[i] = IntegrateKappa(tips_[i], *surface_, kappa_[i], 0.0, timing_.time_step, twist);
  }
  has_begun_ = true;
  return kappa_;
}

TrajectoryController::TrajectoryController(const RobotModel& model, std::span<const int> fingertips,
                                           const MassProperties& object, const Surface& surface,
                                           const GraspControllerOptions& options, const Sampling& sampling)
    : law_(model, fingertips, object, surface, options), sampling_(sampling) {
  if (sampling.contacts) follower_.emplace(model, fingertips, surface, *sampling.contacts);
  Require(sampling.hold > 0, "sampling.hold", "must be positive", sampling.hold);
}

void TrajectoryController::Follow(const Trajectory& motion) {
  motion_ = &motion;
  steps_until_due_ = 0;
}

void TrajectoryController::Begin(double /*t*/, const Reading& /*reading*/) { has_begun_ = true; }

DesiredMotion TrajectoryController::EvaluateDesired(const Trajectory& motion, double t, double time_step) {
  DesiredMotion desired = motion.Evaluate(t);
  // Semi-implicit Euler steps like a leapfrog: velocities belong to the middle of the step before.
  desired.X_d_dot = motion.Evaluate(t - 0.5 * time_step).X_d_dot;
  return desired;
}

void TrajectoryController::BeginCommand(const Trajectory& motion, double t, double time_step,
                                        Command* command) {
  command->tracks = true;
  command->handling = Handling{};
  command->force_seconds = 0.0;
  command->force_solves = 0;
  command->desired = EvaluateDesired(motion, t, time_step);
}

void TrajectoryController::Step(const Reading& reading, double t, Command* command) {
  if (motion_ == nullptr) throw std::logic_error("TrajectoryController: Step before Follow");
  BeginCommand(*motion_, t, sampling_.time_step, command);
  if (follower_ && has_begun_) {
    followed_ = reading.state;
    followed_.kappa = follower_->Follow(reading.state);
    law_.SetState(followed_);
  } else {
    law_.SetState(reading.state);
  }
  if (steps_until_due_ > 0) {
    --steps_until_due_;
    return;
  }
  steps_until_due_ = sampling_.hold - 1;
  command->tau = law_.CalcTorque(command->desired);
  command->force_seconds = law_.force_seconds();
  command->force_solves = 1;
  command->demand.V_Bo_dot = law_.V_Bo_dot();
  command->demand.xi_dot = law_.law().xi_dot_d();
  command->demand.f_c = law_.law().f_c();
  command->demand.F_N = law_.F_N();
}

}  // namespace dexcheck
