#include "harness/checks/judged_law.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <utility>

#include "controller/control/joint_controller.h"
#include "harness/base/worst.h"
#include "harness/checks/check_table.h"
#include "harness/comparison/rounding_scales.h"

namespace dexcheck {

double CalcSampledRadius(const ObjectGains& gains, double time_step, long hold, double velocity_age) {
  const double h = static_cast<double>(hold);
  double radius = 0.0;
  for (Eigen::Index i = 0; i < 6; ++i) {
    // u = -(K_v v + K_p e) is held for h steps: v_h = v + h dt u, e_h = e + h dt v + (h dt / 2 + age) h dt u.
    const double b_v = h * time_step;
    const double b_e = 0.5 * h * (h + 2.0 * velocity_age / time_step) * time_step * time_step;
    Matrix2d A;
    A << 1.0 - b_v * gains.K_v[i], -b_v * gains.K_p[i], b_v - b_e * gains.K_v[i], 1.0 - b_e * gains.K_p[i];
    const double half = 0.5 * A.trace();
    const std::complex<double> root = std::sqrt(std::complex<double>(half * half - A.determinant()));
    const double largest = Worst(std::abs(half + root), std::abs(half - root));
    radius = Worst(radius, largest);
  }
  return std::pow(radius, 1.0 / h);
}

void ReadTerms(const GraspModel& model, const VectorXd& q, const VectorXd& xi, LawTerms* terms) {
  const ModelTerms& robot = model.robot();
  const GraspTerms& grasp = model.grasp();
  terms->q = q;
  terms->xi = xi;
  terms->M = &robot.M();
  terms->C = &robot.C();
  terms->C_xi = robot.C() * xi;
  terms->gravity = robot.gravity();
  terms->friction = robot.friction();
  terms->J = grasp.J_B();
  terms->J_dot = &grasp.J_B_dot();
  terms->J_dot_xi = grasp.J_B_dot() * xi;
  terms->G = grasp.G();
  terms->G_dot_T_V = grasp.G_dot().transpose() * grasp.V_Bo();
  terms->X_Bo = grasp.X_Bo();
  terms->V_Bo = grasp.V_Bo();
  if (model.has_coordinates()) terms->X_o = grasp.X_o();
  terms->M_hat = grasp.body().M_hat;
  terms->C_hat_V = grasp.body().C_hat * grasp.V_Bo();
  terms->N_o = grasp.body().N_o;
}

JudgedLaw::JudgedLaw(const Setup& setup)
    : time_step_(setup.scenario().plant.time_step),
      velocity_age_(setup.scenario().plant.velocity_age()),
      hold_(Worst(1L, std::lround(setup.scenario().plant.control_step / time_step_))),
      stands_(!setup.feet().empty()),
      torque_bound_(CalcBound(*FindCheck("law_torque"), setup.scenario())),
      has_digits_(setup.scenario().tolerance > 0.0),
      actuation_(setup.model()),
      commanded_(setup.model(), static_cast<int>(setup.fingertips().size())),
      own_factor_(setup.model()) {
  difference_.setZero(setup.model().num_velocities());
  least_ = RoundingScales(setup.model()).CalcLeastForces();
}

double JudgedLaw::CalcTorqueError(const StepRecord& step, const LawTerms& terms, const TreeFactor& factor) {
  factor_ = &factor;
  balanced_ = terms.C_xi + terms.gravity + terms.friction;
  scale_ = Worst(CalcScale(Norm(balanced_)), Norm(least_), std::numeric_limits<double>::min());
  actuation_.CalcForce(step.command.tau, difference_);
  difference_ -= force();
  const double error = Norm(difference_) / scale_ / condition_number();
  // A smaller error is rounding, and beside errors above the bound what rounded parameters make.
  if (!exceeds_ && error > torque_bound_) Forget();
  exceeds_ = exceeds_ || error > torque_bound_;
  differs_ = error > (exceeds_ ? torque_bound_ : kLawTorqueBound);
  Remember(step, terms);
  return error;
}

void JudgedLaw::FillStep(const StepRecord& step, const LawTerms& terms, LawStep* state) const {
  state->time = step.time;
  state->q = terms.q;
  state->xi = terms.xi;
  state->object = {terms.X_Bo, terms.V_Bo, terms.X_o};
  state->force = force();
  CopyDesired(state);
}

LawInputs JudgedLaw::CopyAll(const StepRecord& step, const LawTerms& terms, LawStep now) const {
  LawInputs inputs{
      .now = std::move(now), .terms = terms, .M = *terms.M, .C = *terms.C, .J_dot = *terms.J_dot};
  CopyInputs(step, &inputs);
  return inputs;
}

LawInputs JudgedLaw::MakeInputs(const StepRecord& step, const LawTerms& terms) {
  const bool has_force = Evaluate(step, terms);
  LawStep now;
  FillStep(step, terms, &now);
  if (!has_force) now.force.resize(0);
  return CopyAll(step, terms, std::move(now));
}

void JudgedLaw::Remember(const StepRecord& step, const LawTerms& terms) {
  if (state_.force.size() > 0 && state_.time == step.time) return;  // known already
  if (!has_digits_) return RememberEvaluated(step, terms);
  // The law has the controller's numbers: beside faults, digits that the engine's lack would look like some.
  LawTerms own = terms;
  ReadTerms(*step.model, terms.q, terms.xi, &own);
  Evaluate(step, own);
  actuation_.CalcForce(step.command.tau, difference_);
  difference_ -= force();
  differs_ = differs_ && Norm(difference_) > kLawTorqueBound * noise_scale();
  RememberEvaluated(step, own);
  Evaluate(step, terms);
  actuation_.CalcForce(step.command.tau, difference_);
  difference_ -= force();
}

void JudgedLaw::RememberEvaluated(const StepRecord& step, const LawTerms& terms) {
  FillStep(step, terms, &state_);
  state_.sent = state_.force + difference_;
  if (differs_ && history_.Wants()) {
    history_.Keep({.inputs = CopyAll(step, terms, state_),
                   .difference = difference_,
                   .noise = kLawTorqueBound * noise_scale()});
  } else if (differs_) {
    history_.Skip();
  }
  history_.Remember(state_, control_step());
}

double JudgedLaw::CompareTorque(const StepRecord& step, const LawTerms& terms) {
  own_factor_.Compute(*terms.M);
  if (!Evaluate(step, terms)) return std::numeric_limits<double>::infinity();
  return CalcTorqueError(step, terms, own_factor_);
}

// The law of a robot that holds nothing and follows a motion of its joints.

namespace {

class JudgedJointLaw final : public JudgedLaw {
 public:
  explicit JudgedJointLaw(const Setup& setup)
      : JudgedLaw(setup),
        law_(setup.scenario().control.law),
        gains_(setup.joints()->gains),
        motion_(&setup.joints()->motion) {
    if (stands_) ground_.emplace(setup.model(), setup.feet(), gains_.stance->height);
    if (setup.scenario().plant.implicit_damping) {
      const RobotModel& model = setup.model();
      damping_.setZero(model.num_velocities());
      for (int k = 0; k < model.num_dofs(); ++k)
        damping_[model.num_base_velocities() + k] = model.joint(model.joint_of_dof(k)).damping;
    }
    for (VectorXd* vector : {&force_, &demand_, &true_demand_, &commanded_force_, &coulomb_, &viscous_,
                             &position_error_, &velocity_error_, &ground_force_})
      vector->setZero(setup.model().num_velocities());
    // Only computed torque has gains here: the gain of a joint in other laws is the feedback in its torque.
    if (law_ != ControlLaw::kComputedTorque) return;
    for (const char* gain : {"K_v", "K_p"})
      for (int i = 0; i < setup.model().num_velocities(); ++i) {
        const int dof = i - setup.model().num_base_velocities();
        gain_names_.push_back(std::string(gain) + " of " + (dof < 0 ? "base" : setup.model().dof_name(dof)));
      }
  }

  [[nodiscard]] std::optional<double> CalcSpectralRadius() const override {
    if (law_ != ControlLaw::kComputedTorque) return std::nullopt;
    double radius = 0.0;
    for (Eigen::Index i = 0; i < gains_.K_p.size(); ++i) {
      ObjectGains one;
      one.K_p.setConstant(gains_.K_p[i]);
      one.K_v.setConstant(gains_.K_v[i]);
      radius = Worst(radius, CalcSampledRadius(one, time_step_, hold_, velocity_age_));
    }
    return radius;
  }
  [[nodiscard]] bool IsComputed(const Command& command) const override { return command.computes_joints; }

  const LawErrors& Compare(const StepRecord& step, const LawTerms& terms, const StepAnalyzer& plant,
                           bool as_commanded) override {
    errors_ = LawErrors{};
    errors_.torque = CompareTorque(step, terms);
    if (!follows_error()) return errors_;
    const VectorXd* predicted = &plant.analysis().findings.xi_dot_model;
    if (!as_commanded || compensates()) {
      actuation_.CalcForce(step.command.tau, commanded_force_);
      // The rigid robot has no friction to compensate.
      commanded_force_ -= coulomb_ + viscous_;
      predicted = &commanded_.PredictFree(step.model->robot(), commanded_force_).xi_dot;
    }
    FollowError(step, plant.analysis().declared->is_ideal ? predicted : nullptr);
    return errors_;
  }

  [[nodiscard]] std::span<const LawPartName> ListParts() const override { return ListJointLawParts(); }
  void RemoveGain(size_t gain, LawInputs* inputs) const override {
    const auto n = static_cast<size_t>(force_.size());
    (gain < n ? inputs->velocity_error : inputs->now.position_error)[static_cast<Eigen::Index>(gain % n)] =
        0.0;
  }
  [[nodiscard]] bool demands_acceleration() const override { return law_ == ControlLaw::kComputedTorque; }
  [[nodiscard]] VectorXd CalcForce(const LawInputs& inputs) override {
    const LawTerms& terms = inputs.Link();
    desired_ = inputs.now.joints;
    position_error_ = inputs.now.position_error;
    velocity_error_ = inputs.velocity_error;
    coulomb_ = inputs.coulomb;
    viscous_ = inputs.viscous;
    EvaluateForce(terms);
    if (inputs.feeds_back_torques || inputs.feeds_back_by_diagonal) {
      const VectorXd feedback =
          gains_.K_v.cwiseProduct(velocity_error_) + gains_.K_p.cwiseProduct(position_error_);
      force_ -= inputs.M * feedback;
      force_ += inputs.feeds_back_torques ? feedback : inputs.M.diagonal().cwiseProduct(feedback);
    }
    if (inputs.ground_force.size() > 0) force_ -= inputs.ground_force;
    return force_;
  }

 protected:
  bool Evaluate(const StepRecord& step, const LawTerms& terms) override {
    JointDemand::EvaluateDesired(*motion_, step.time, 2.0 * velocity_age_, &desired_, &half_step_);
    CalcCompensation();
    CalcPositionError(stands_, desired_.q, terms.q, position_error_);
    velocity_error_ = desired_.q_dot - terms.xi;
    const bool has_forces = EvaluateForce(terms);
    if (ground_ && step.command.demand.f_c.size() == ground_->J().rows()) {
      // (F - J^T f)_joints, with an f that has to balance F_b
      ground_->SetState(step.model->robot());
      ground_force_.noalias() = ground_->J().transpose() * step.command.demand.f_c;
      force_ -= ground_force_;
    }
    return has_forces;
  }
  void CopyDesired(LawStep* state) const override {
    state->joints = desired_;
    state->position_error = position_error_;
  }
  void CopyInputs(const StepRecord& step, LawInputs* inputs) const override {
    inputs->velocity_error = velocity_error_;
    inputs->coulomb = coulomb_;
    inputs->viscous = viscous_;
    if (ground_ && step.command.demand.f_c.size() == ground_->J().rows())
      inputs->ground_force = ground_force_;
  }
  bool EvaluateForce(const LawTerms& terms) {
    force_ = terms.C_xi + terms.gravity + terms.friction + coulomb_ + viscous_;
    if (law_ == ControlLaw::kComputedTorque) {
      // M_bar' (q_d_ddot + K_v e_dot + K_p e) + C_bar' q_dot + F_bar' + tau_f
      demand_ = desired_.q_ddot + gains_.K_v.cwiseProduct(velocity_error_) +
                gains_.K_p.cwiseProduct(position_error_);
      force_.noalias() += *terms.M * demand_;
      return true;
    }
    // K e + D e_dot + g + tau_f [+ M_bar' q_d_ddot + C_bar' q_d_dot + friction]
    if (law_ == ControlLaw::kPdGravity) {
      force_ = terms.gravity + coulomb_ + viscous_;
    } else {
      force_.noalias() += *terms.M * desired_.q_ddot;
      demand_ = desired_.q_dot - terms.xi;
      force_.noalias() += *terms.C * demand_;
    }
    force_ += gains_.K.cwiseProduct(position_error_);
    force_ += gains_.D.cwiseProduct(velocity_error_);
    return true;
  }
  [[nodiscard]] const VectorXd& force() const override { return force_; }
  /// The scale of rounding is the torque itself where it is much larger than the forces that it balances.
  [[nodiscard]] double CalcScale(double balanced) override { return Worst(balanced, Norm(force_)); }

 private:
  [[nodiscard]] bool compensates() const { return gains_.coulomb.size() + gains_.viscous.size() > 0; }
  void CalcCompensation() {
    for (Eigen::Index i = 0; i < gains_.coulomb.size(); ++i)
      coulomb_[i] = gains_.coulomb[i] * std::tanh(desired_.q_dot[i] / gains_.coulomb_velocity);
    for (Eigen::Index i = 0; i < gains_.viscous.size(); ++i)
      viscous_[i] = gains_.viscous[i] * desired_.q_dot[i];
  }

  /// K_v e_dot + K_p e + q_d_ddot.
  void CalcDemand(const VectorXd& q, const VectorXd& xi, VectorXd* xi_dot) const {
    *xi_dot = desired_.q_ddot;
    *xi_dot += gains_.K_v.cwiseProduct(desired_.q_dot - xi);
    *xi_dot += gains_.K_p.cwiseProduct(desired_.q - q);
  }

  /// @param predicted xi_dot of the rigid robot; null where the true error's own demand stands for it.
  void FollowError(const StepRecord& step, const VectorXd* predicted) {
    const MeasuredState& truth = step.reading.state;
    if (q_.size() == 0) {
      q_ = truth.q;
      xi_ = truth.xi;
    }
    errors_.error_dynamics = MaxAbs(q_ - truth.q);
    CalcDemand(q_, xi_, &demand_);
    // The plant's motion beyond the rigid prediction is added. Where the controller measures otherwise, where
    // its torques arrive otherwise or the robot is pushed, all of that drives the error as well.
    demand_ += step.response.xi_dot;
    if (damping_.size() > 0) {
      // The engine's implicit damping integrates (M + dt D)^-1 M xi_dot.
      damped_ = step.model->robot().M();
      damped_.diagonal() += time_step_ * damping_;
      damped_rates_ = time_step_ * damping_.cwiseProduct(step.response.xi_dot);
      damped_factor_.compute(damped_);
      damped_factor_.solveInPlace(damped_rates_);
      demand_ -= damped_rates_;
    }
    if (predicted == nullptr) CalcDemand(truth.q, truth.xi, &true_demand_);
    demand_ -= predicted != nullptr ? *predicted : true_demand_;
    // Semi-implicit, as the plant: velocities first.
    xi_ += time_step_ * demand_;
    q_ += time_step_ * xi_;
  }

  ControlLaw law_;
  JointGains gains_;
  const JointMotion* motion_;
  DesiredJoints desired_, half_step_;
  VectorXd force_, demand_, true_demand_, commanded_force_;  // n
  VectorXd coulomb_, viscous_;                               // n, compensated friction
  VectorXd position_error_, velocity_error_;                 // n, q_d - q and q_d_dot - q_dot
  VectorXd ground_force_;                                    // n, J^T f that the ground is asked for
  std::optional<GroundContacts> ground_;                     // of a robot that stands
  VectorXd damping_, damped_rates_;                          // n, of implicit damping; empty without
  MatrixXd damped_;
  Eigen::LLT<MatrixXd> damped_factor_;
  VectorXd q_, xi_;  // where the error dynamics have the joints; empty at first
};

}  // namespace

std::unique_ptr<JudgedLaw> MakeJointLaw(const Setup& setup) {
  return std::make_unique<JudgedJointLaw>(setup);
}

}  // namespace dexcheck
