#include "controller/control/grasp_controller.h"

#include <chrono>

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
      model_(GraspModel(model, fingertips, object, surface, options)),
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

}  // namespace dexcheck
