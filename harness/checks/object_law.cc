// The paper's law (55), and those that it is compared with.

#include <algorithm>
#include <cmath>

#include "controller/control/trajectory.h"
#include "controller/object/so3.h"
#include "harness/base/worst.h"
#include "harness/checks/baseline_reference.h"
#include "harness/checks/check_table.h"
#include "harness/checks/judged_law.h"
#include "harness/checks/law_reference.h"
#include "harness/checks/step_analysis.h"

namespace dexcheck {
namespace {

/// Between two orientations, rad; good to rounding where it is small.
double CalcAngle(const Matrix3d& a, const Matrix3d& b) {
  const Matrix3d D = a.transpose() * b;
  const Vector3d twice_sine(D(2, 1) - D(1, 2), D(0, 2) - D(2, 0), D(1, 0) - D(0, 1));
  return std::atan2(0.5 * twice_sine.norm(), 0.5 * (D.trace() - 1.0));
}

/// Distance and angle.
void CalcApart(const Pose& a, const Pose& b, double* position, double* orientation) {
  *position = (a.translation() - b.translation()).norm();
  *orientation = CalcAngle(a.linear(), b.linear());
}

// (57) integrated beside a run.

/// The object under (57) from t = 0 on: by itself, driven by the plant's motion beyond the prediction, and
/// driven by the quantities that are held during a step. Each steps as the plant does.
class ObjectErrorDynamics {
 public:
  /// @param velocity_age by how much velocities are older than positions, s; 0 of a plant that accelerates
  /// within a step.
  ObjectErrorDynamics(const LawSpec& spec, double time_step, double velocity_age)
      : spec_(spec), time_step_(time_step), velocity_age_(velocity_age) {}

  /// Follows the next step. @param terms of the law. @param predicted V_o_dot of the rigid system under the
  /// torques; null where torques, readings or pushes are not those of the law: then (57) is driven by the
  /// object's motion beyond the demand of its true error. @param errors gets the distances.
  void Follow(const StepRecord& step, const LawTerms& terms, const DesiredMotion& desired,
              const Vector6d* predicted, LawReference* law, LawErrors* errors);

 private:
  struct Followed {
    LawObject object;                   // velocities as old as the plant's
    Vector6d V_dot = Vector6d::Zero();  // from this step to the next
  };
  [[nodiscard]] bool accelerates_within_step() const { return velocity_age_ == 0.0; }
  /// Follows (57) by itself, and driven by the held quantities, from the step before to this one.
  void FollowHeld(const LawObject& truth, const DesiredMotion& desired, LawReference* law);
  void UpdateAngles(LawObject* object) const;
  /// Moves one step as the plant does. @param change half the step's change of p_ddot (world) and omega_dot.
  void Move(const Vector6d& change, Followed* one) const;
  /// p_ddot (world) and omega_dot.
  static Vector6d CalcWorldAcceleration(const Followed& one);

  LawSpec spec_;
  double time_step_, velocity_age_;
  bool has_begun_ = false;
  Followed followed_, undisturbed_, held_;  // (57) driven by everything, by nothing, by held quantities
  Followed before_;                         // the plant's object, a step before
};

void ObjectErrorDynamics::UpdateAngles(LawObject* object) const {
  if (spec_.orientation == OrientationFeedback::kAngles)
    object->X_o = CalcObjectCoordinates(object->X_Bo, object->X_o);
}

void ObjectErrorDynamics::Follow(const StepRecord& step, const LawTerms& terms, const DesiredMotion& desired,
                                 const Vector6d* predicted, LawReference* law, LawErrors* errors) {
  // The true object, which the law's terms need not be at.
  LawObject truth{terms.X_Bo, terms.V_Bo, terms.X_o};
  if (predicted == nullptr) {
    truth = {step.reading.state.X_Bo, step.reading.state.V_Bo, terms.X_o};
    UpdateAngles(&truth);
  }
  if (!has_begun_) {
    followed_.object = undisturbed_.object = held_.object = truth;
    has_begun_ = true;
  } else if (accelerates_within_step()) {
    FollowHeld(truth, desired, law);
  } else {
    Move(Vector6d::Zero(), &followed_);
    Move(Vector6d::Zero(), &undisturbed_);
  }
  before_ = {truth, step.response.V_Bo_dot};
  CalcApart(followed_.object.X_Bo, truth.X_Bo, &errors->error_dynamics, &errors->orientation_dynamics);
  CalcApart(undisturbed_.object.X_Bo, CalcObjectPose(desired.X_d), &errors->position_by_law,
            &errors->orientation_by_law);
  if (accelerates_within_step())
    CalcApart(held_.object.X_Bo, undisturbed_.object.X_Bo, &errors->position_by_hold,
              &errors->orientation_by_hold);
  for (Followed* one : {accelerates_within_step() ? &held_ : &followed_, &undisturbed_}) {
    UpdateAngles(&one->object);
    one->V_dot = law->CalcDemand(spec_, one->object, desired);
  }
  // The motion of the plant's object beyond the rigid prediction is added.
  followed_.V_dot +=
      step.response.V_Bo_dot - (predicted == nullptr ? law->CalcDemand(spec_, truth, desired) : *predicted);
}

void ObjectErrorDynamics::FollowHeld(const LawObject& truth, const DesiredMotion& desired,
                                     LawReference* law) {
  // (57) itself does not stand still within a step: Heun's method.
  Followed end = undisturbed_;
  Move(Vector6d::Zero(), &end);
  UpdateAngles(&end.object);
  end.V_dot = law->CalcDemand(spec_, end.object, desired);
  Move(0.5 * (CalcWorldAcceleration(end) - CalcWorldAcceleration(undisturbed_)), &undisturbed_);
  // Mean acceleration of the plant, less that of the step's beginning.
  const LawObject& from = before_.object;
  Vector6d change = truth.V_Bo - from.V_Bo;
  change.head<3>() = truth.X_Bo.linear() * truth.V_Bo.head<3>() - from.X_Bo.linear() * from.V_Bo.head<3>();
  Move(change / time_step_ - CalcWorldAcceleration(before_), &held_);
}

Vector6d ObjectErrorDynamics::CalcWorldAcceleration(const Followed& one) {
  // v = R^T p_dot, hence p_ddot = R (v_dot + omega x v).
  Vector6d acceleration = one.V_dot;
  acceleration.head<3>() += one.object.V_Bo.tail<3>().cross(one.object.V_Bo.head<3>());
  acceleration.head<3>() = one.object.X_Bo.linear() * acceleration.head<3>().eval();
  return acceleration;
}

void ObjectErrorDynamics::Move(const Vector6d& change, Followed* one) const {
  const Vector6d& V_dot = one->V_dot;
  LawObject* const object = &one->object;
  Matrix3d R = object->X_Bo.linear();
  const Vector3d v = object->V_Bo.head<3>();
  Vector3d omega = object->V_Bo.tail<3>();
  const Vector3d p_ddot = V_dot.head<3>() + omega.cross(v);
  const Vector3d p_dot = R * (v + time_step_ * p_ddot) + time_step_ * change.head<3>();
  omega += time_step_ * (V_dot.tail<3>() + change.tail<3>());
  // Velocities v_0 + dt (a + c) of positions x_0 + dt v_0 + dt^2 (a / 2 + c / 3), where the acceleration
  // goes from a to a + 2 c; by Euler's method c is zero and positions go by the new velocity.
  const double before = 0.5 * time_step_ - velocity_age_;
  constexpr double kFraction = 4.0 / 3.0;
  object->X_Bo.translation() += time_step_ * (p_dot - before * (R * p_ddot + kFraction * change.head<3>()));
  R = R * ExpSo3(time_step_ * (omega - before * (V_dot.tail<3>() + kFraction * change.tail<3>())));
  object->X_Bo.linear() = Eigen::Quaterniond(R).normalized().toRotationMatrix();
  object->V_Bo << object->X_Bo.linear().transpose() * p_dot, omega;
}

// The bounds of F_N follow from the solver's options, which no scenario changes.
static_assert(kGraspNullBound >= 10.0 * GraspForceOptions{}.residual_tolerance);
static_assert(kGraspOptimalityBound == 10.0 * GraspForceOptions{}.slack_tolerance);
// Slip's changes of accelerations and forces, over the condition number, relative to these forces.
constexpr double kSlipFraction = 10.0;
constexpr double kSmallest = std::numeric_limits<double>::min();

/// Computes the scenario's law at each step from the other provider's terms, the scenario's gains and its
/// trajectory. It takes from the controller F_N, which the law may choose, X_o's angles on the law's branch
/// (checks of the model compare their pose), and C_bar', J_B_dot', which multiply only the slip.
class JudgedObjectLaw final : public JudgedLaw {
 public:
  explicit JudgedObjectLaw(const Setup& setup)
      : JudgedLaw(setup),
        options_(setup.MakeControllerOptions()),
        spec_(MakeLawSpec(options_)),
        trajectory_(setup.MakeTrajectory()),
        motion_(trajectory_.get()),
        reference_(setup.model().num_velocities(), 3 * static_cast<int>(setup.fingertips().size())),
        error_(spec_, time_step_, velocity_age_) {
    const int n = setup.model().num_velocities();
    const int k = 3 * static_cast<int>(setup.fingertips().size());
    if (options_.law != ControlLaw::kComputedTorque)
      baseline_.emplace(options_.law, options_.stiffness, n, k);
    work_n_.setZero(n);
    work_k_.setZero(k);
    for (const char* gain : {baseline_ ? "D" : "K_v", baseline_ ? "K" : "K_p"}) {
      if (gain == std::string_view("D") && has_one_damping()) continue;
      for (const char* axis : {"x", "y", "z", "rotation 1", "rotation 2", "rotation 3"})
        gain_names_.push_back(std::string(gain) + " of " + axis);
    }
  }

  /// (57) is the error dynamics of the paper's law and, by algebra, of operational space control.
  [[nodiscard]] std::optional<double> CalcSpectralRadius() const override {
    if (baseline_ && options_.law != ControlLaw::kOperationalSpace) return std::nullopt;
    return CalcSampledRadius(spec_.gains, time_step_, hold_, velocity_age_);
  }
  [[nodiscard]] bool has_demand() const override { return !baseline_; }
  [[nodiscard]] bool IsComputed(const Command& command) const override {
    return !command.handling.partial && command.force_solves > 0;
  }

  const LawErrors& Compare(const StepRecord& step, const LawTerms& terms, const StepAnalyzer& plant,
                           bool as_commanded) override {
    errors_ = LawErrors{};
    if (!Evaluate(step, terms)) return errors_;
    const Motion moved = as_commanded ? Motion{&plant.analysis().findings.xi_dot_model,
                                               &plant.analysis().findings.V_Bo_dot_model,
                                               &plant.analysis().findings.f_c_model, &plant.mass_factor()}
                                      : Predict(step);
    errors_.torque = CalcTorqueError(step, terms, *moved.mass_factor);
    if (!baseline_) CompareDemand(moved, /*has_slip=*/as_commanded);
    CompareGraspForce(terms, step.command.demand.F_N, baseline_ ? baseline_->f_c() : reference_.f_c());
    if (CalcSpectralRadius() && hold_ == 1) {
      error_.Follow(step, terms, desired_, plant.analysis().declared->is_ideal ? moved.V_Bo_dot : nullptr,
                    &reference_, &errors_);
    }
    return errors_;
  }

  void Follow(const Trajectory* motion, double begin) override {
    motion_ = motion == nullptr ? trajectory_.get() : motion;
    begin_ = motion == nullptr ? 0.0 : begin;
  }
  [[nodiscard]] std::span<const LawPartName> ListParts() const override { return ListLawParts(); }
  void RemoveGain(size_t gain, LawInputs* inputs) const override {
    LawSpec& spec = *inputs->spec;
    if (has_one_damping()) gain += 6;
    (gain < 6 ? spec.velocity_factor : spec.position_factor)[static_cast<Eigen::Index>(gain % 6)] = 0.0;
  }
  [[nodiscard]] bool demands_acceleration() const override {
    return !baseline_ || options_.law == ControlLaw::kOperationalSpace;
  }
  [[nodiscard]] VectorXd CalcForce(const LawInputs& inputs) override {
    const LawTerms& terms = inputs.Link();
    const bool has_force = reference_.Evaluate(*inputs.spec, terms, inputs.now.desired, inputs.F_N) &&
                           (!baseline_ || baseline_->Evaluate(*inputs.spec, reference_, terms, inputs.G_dot,
                                                              inputs.now.desired, inputs.F_N));
    if (!has_force) return {};
    VectorXd result = force();
    if (!inputs.exchanges_force_axes) return result;
    const VectorXd& f_c = baseline_ ? baseline_->f_c() : reference_.f_c();
    VectorXd change = VectorXd::Zero(f_c.size());
    for (Eigen::Index i = 0; i < f_c.size(); i += 3)
      change.segment<2>(i) << f_c[i + 1] - f_c[i], f_c[i] - f_c[i + 1];
    result.noalias() += terms.J.transpose() * change;
    return result;
  }

 protected:
  bool Evaluate(const StepRecord& step, const LawTerms& terms) override {
    // Semi-implicit Euler steps like a leapfrog: velocities belong to the middle of the step before.
    desired_ = motion_->Evaluate(step.time - begin_);
    desired_.X_d_dot = motion_->Evaluate(step.time - begin_ - velocity_age_).X_d_dot;
    const VectorXd& F_N = step.command.demand.F_N;
    return reference_.Evaluate(spec_, terms, desired_, F_N) &&
           (!baseline_ ||
            baseline_->Evaluate(spec_, reference_, terms, step.model->grasp().G_dot(), desired_, F_N));
  }
  [[nodiscard]] const VectorXd& force() const override {
    return baseline_ ? baseline_->force() : reference_.force();
  }
  [[nodiscard]] double condition_number() const override { return reference_.condition_number(); }
  void CopyDesired(LawStep* state) const override { state->desired = desired_; }
  void CopyInputs(const StepRecord& step, LawInputs* inputs) const override {
    inputs->G_dot = step.model->grasp().G_dot();
    inputs->F_N = step.command.demand.F_N;
    inputs->spec = spec_;
  }

 private:
  /// An impedance's damping follows from its stiffness and one ratio.
  [[nodiscard]] bool has_one_damping() const { return options_.law == ControlLaw::kImpedance; }

  /// Motion of a rigid system under some torques.
  struct Motion {
    const VectorXd* xi_dot;
    const Vector6d* V_Bo_dot;
    const VectorXd* f_c;
    const TreeFactor* mass_factor;
  };

  /// Predicts the motion of the controller's rigid system under the commanded torques. Measured rates need
  /// not fit together: (47), (55) plan for xi_c, nearest to xi without slip. With C_bar' xi_c and J_dot xi_c
  /// in (48), (46) the rigid system does exactly what is demanded.
  Motion Predict(const StepRecord& step) {
    actuation_.CalcForce(step.command.tau, work_n_);
    work_n_ -= reference_.slip_coriolis();
    work_k_ = -reference_.slip_rates();
    const Prediction& prediction =
        commanded_.Predict(step.model->robot(), step.model->grasp(), work_n_, ObjectSupport::kHand, &work_k_);
    return {&prediction.xi_dot, &prediction.V_Bo_dot, &prediction.f_c, &commanded_.mass_factor()};
  }

  /// @param has_slip whether the rigid system starts from xi, and not from xi_c, as (47) plans: the
  /// difference by slip is then subtracted.
  void CompareDemand(const Motion& moved, bool has_slip) {
    // |a|_M = |L a|
    work_n_ = *moved.xi_dot - reference_.xi_dot_d();
    factor_->Multiply(work_n_);
    const double motion = work_n_.norm() / scale_;
    const VectorXd& f_c = reference_.f_c();
    const double forces = (*moved.f_c - f_c).norm() / Worst(f_c.norm(), kSmallest);
    const double error = Worst(motion, forces) / reference_.condition_number();
    errors_.demand = errors_.demand_residual = error;
    if (!has_slip) return;
    work_n_ = reference_.slip_acceleration();
    factor_->Multiply(work_n_);
    const double by_motion = kSlipFraction * work_n_.norm() / scale_, apart = error - by_motion;
    errors_.demand_by_slip = by_motion;
    errors_.demand = 0.0;
    if (apart <= 0.0) return;
    const double by_coriolis = kSlipFraction * Norm(reference_.slip_coriolis()) / scale_;
    errors_.demand_by_slip += by_coriolis;
    errors_.demand = Worst(apart - by_coriolis, 0.0);
  }

  void CompareGraspForce(const LawTerms& terms, const VectorXd& F_N, const VectorXd& f_c) {
    const double size = Worst(1.0, f_c.norm());
    errors_.grasp_null_space = MaxAbs(terms.G * F_N) / size;
    // Slope of sum f_i3 - rho [sum log det P_i + sum log slack]: at the optimum it is in the range of G^T, so
    // that no internal force improves on F_N.
    double outside = 0.0;
    const double rho = options_.force.barrier_weight;
    const double mu = options_.mu, f_min = options_.f_min, f_max = options_.f_max;
    for (Eigen::Index i = 0; i < f_c.size(); i += 3) {
      const double x = f_c[i], y = f_c[i + 1], z = f_c[i + 2];
      const double det = mu * mu * z * z - x * x - y * y;
      outside = Worst(outside, std::hypot(x, y) - mu * z, f_min - z, z - f_max);
      work_k_.segment<3>(i) << 2.0 * rho * x / det, 2.0 * rho * y / det,
          1.0 - 2.0 * rho * mu * mu * z / det - rho / (z - f_min) + rho / (f_max - z);
    }
    errors_.grasp_cone = outside / size;
    if (outside > 0.0) return;
    const double whole = work_k_.norm();
    const Vector6d y = reference_.SolveGrasp(work_k_);
    work_k_.noalias() -= terms.G.transpose() * y;
    errors_.grasp_optimality = work_k_.norm() / Worst(whole, 1.0);
  }

  GraspControllerOptions options_;
  LawSpec spec_;
  std::unique_ptr<Trajectory> trajectory_;
  const Trajectory* motion_;
  double begin_ = 0.0;  // s, of that motion
  LawReference reference_;
  std::optional<BaselineReference> baseline_;  // none for the paper's law
  ObjectErrorDynamics error_;
  DesiredMotion desired_;
  VectorXd work_n_, work_k_;
};

}  // namespace

std::unique_ptr<JudgedLaw> MakeObjectLaw(const Setup& setup) {
  return std::make_unique<JudgedObjectLaw>(setup);
}

}  // namespace dexcheck
