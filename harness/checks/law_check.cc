#include "harness/checks/law_check.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

#include "controller/object/euler_zyz.h"
#include "controller/object/so3.h"
#include "harness/checks/known_plant.h"
#include "harness/checks/step_check_table.h"

namespace dexcheck {
namespace {

// What F_N is judged by follows from the solver's options, which no scenario changes.
static_assert(kGraspNullBound >= 10.0 * GraspForceOptions{}.residual_tolerance);
static_assert(kGraspOptimalityBound == 10.0 * GraspForceOptions{}.slack_tolerance);
// What slip changes in accelerations and forces, over the condition number, against the forces that it
// changes.
constexpr double kSlipFraction = 10.0;

/// Between two orientations, rad; good to rounding where it is small.
double CalcAngle(const Matrix3d& a, const Matrix3d& b) {
  const Matrix3d D = a.transpose() * b;
  const Vector3d twice_sine(D(2, 1) - D(1, 2), D(0, 2) - D(2, 0), D(1, 0) - D(0, 1));
  return std::atan2(0.5 * twice_sine.norm(), 0.5 * (D.trace() - 1.0));
}

}  // namespace

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
    const double largest = std::max(std::abs(half + root), std::abs(half - root));
    radius = std::max(radius, std::isnan(largest) ? std::numeric_limits<double>::infinity() : largest);
  }
  return std::pow(radius, 1.0 / h);
}

LawCheck::LawCheck(const Setup& setup)
    : spec_(MakeLawSpec(setup.MakeControllerOptions())),
      time_step_(setup.scenario().plant.time_step),
      velocity_age_(setup.scenario().plant.velocity_age()),
      hold_(std::max(1L, std::lround(setup.scenario().plant.control_step / time_step_))),
      sampled_radius_(CalcSampledRadius(spec_.gains, time_step_, hold_, velocity_age_)),
      actuation_(setup.model()),
      reference_(setup.model().num_velocities(), 3 * static_cast<int>(setup.fingertips().size())),
      own_factor_(setup.model()) {
  const GraspControllerOptions options = setup.MakeControllerOptions();
  mu_ = options.mu;
  f_min_ = options.f_min;
  f_max_ = options.f_max;
  barrier_weight_ = options.force.barrier_weight;
  const int n = setup.model().num_velocities();
  const int k = 3 * static_cast<int>(setup.fingertips().size());
  if (options.law != ControlLaw::kComputedTorque) {
    baseline_ = std::make_unique<BaselineReference>(options.law, options.stiffness, n, k);
    has_error_dynamics_ = options.law == ControlLaw::kOperationalSpace;
  }
  trajectory_ = setup.MakeTrajectory();
  force_.setZero(setup.model().num_velocities());
  difference_ = force_;
  slope_.setZero(3 * static_cast<Eigen::Index>(setup.fingertips().size()));
}

DesiredMotion LawCheck::EvaluateDesired(double t) const {
  // Semi-implicit Euler steps like a leapfrog: velocities belong to the middle of the step before.
  DesiredMotion desired = trajectory_->Evaluate(t);
  desired.X_d_dot = trajectory_->Evaluate(t - velocity_age_).X_d_dot;
  return desired;
}

double LawCheck::Norm(const VectorXd& force) { return mass_factor_->CalcForceNorm(force, &work_); }

void LawCheck::Evaluate(const StepRecord& step, const LawTerms& terms) {
  desired_ = EvaluateDesired(step.time);
  is_evaluated_ = reference_.Evaluate(spec_, terms, desired_, step.command.demand.F_N);
}

const LawErrors& LawCheck::Compare(const StepRecord& step, const StepFindings& findings,
                                   const LawTerms& terms, const TreeFactor& mass_factor, bool knows_slip) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  mass_factor_ = &mass_factor;
  const DesiredMotion& desired = desired_;
  errors_ = LawErrors{};
  if (!is_evaluated_) {
    errors_ = {kInfinity, kInfinity, kInfinity, kInfinity, kInfinity, kInfinity};
    return errors_;
  }
  force_ = terms.C_xi + terms.gravity + terms.friction;
  scale_ = std::max(Norm(force_), std::numeric_limits<double>::min());
  if (baseline_) {
    const Matrix6Xd& G_dot = step.model->grasp().G_dot();
    if (!baseline_->Evaluate(spec_, reference_, terms, G_dot, desired, step.command.demand.F_N)) {
      errors_ = {kInfinity, kInfinity, kInfinity, kInfinity, kInfinity, kInfinity};
      return errors_;
    }
    CompareTorque(step, terms, baseline_->force());
    CompareGraspForce(step, terms, baseline_->f_c());
  } else {
    CompareTorque(step, terms, reference_.force());
    CompareDemand(findings, knows_slip);
    CompareGraspForce(step, terms, reference_.f_c());
  }
  if (has_error_dynamics_ && hold_ == 1) FollowError(step, findings, terms, desired);
  return errors_;
}

double LawCheck::CompareUnsent(const StepRecord& step, const LawTerms& terms) {
  own_factor_.Compute(terms.M);
  mass_factor_ = &own_factor_;
  errors_ = LawErrors{};
  const VectorXd& F_N = step.command.demand.F_N;
  Evaluate(step, terms);
  if (!is_evaluated_ || (baseline_ && !baseline_->Evaluate(spec_, reference_, terms,
                                                           step.model->grasp().G_dot(), desired_, F_N))) {
    return std::numeric_limits<double>::infinity();
  }
  force_ = terms.C_xi + terms.gravity + terms.friction;
  scale_ = std::max(Norm(force_), std::numeric_limits<double>::min());
  CompareTorque(step, terms, baseline_ ? baseline_->force() : reference_.force());
  return errors_.torque;
}

double LawCheck::CompareApplied(const StepRecord& step) {
  const VectorXd& expected = step.known != nullptr ? step.known->tau : step.command.tau;
  return (step.response.motor_torques - expected).cwiseAbs().maxCoeff() /
         std::max(step.command.tau.cwiseAbs().maxCoeff(), std::numeric_limits<double>::min());
}

void LawCheck::CompareTorque(const StepRecord& step, const LawTerms& terms, const VectorXd& force) {
  actuation_.CalcForce(step.command.tau, force_);
  difference_ = force_ - force;
  const double relative = Norm(difference_) / scale_;
  errors_.torque = relative / reference_.condition_number();
  // Less is rounding, which tells nothing, and only the printed law is known summand by summand.
  if (!baseline_ && errors_.torque > kLawTorqueBound)
    attribution_.Add(difference_, reference_.CalcParts(terms, step.command.demand.F_N), 1.0 / scale_);
}

void LawCheck::CompareDemand(const StepFindings& findings, bool knows_slip) {
  // |a|_M = |L a|
  difference_ = findings.xi_dot_model - reference_.xi_dot_d();
  mass_factor_->Multiply(difference_);
  const double motion = difference_.norm() / scale_;
  const VectorXd& f_c = reference_.f_c();
  const double forces =
      (findings.f_c_model - f_c).norm() / std::max(f_c.norm(), std::numeric_limits<double>::min());
  const double kappa = reference_.condition_number();
  if (knows_slip) {
    errors_.demand = std::max(motion, forces) / kappa;
    return;
  }
  // Where contacts slip, (47) plans for xi_c and the rigid system starts from xi.
  difference_ = reference_.slip_acceleration();
  mass_factor_->Multiply(difference_);
  const double apart = std::max(motion, forces) / kappa - kSlipFraction * difference_.norm() / scale_;
  const bool slip_explains = apart <= 0.0;
  errors_.demand =
      slip_explains ? 0.0 : std::max(apart - kSlipFraction * Norm(reference_.slip_coriolis()) / scale_, 0.0);
}

void LawCheck::CompareGraspForce(const StepRecord& step, const LawTerms& terms, const VectorXd& f_c) {
  const VectorXd& F_N = step.command.demand.F_N;
  const double size = std::max(1.0, f_c.norm());
  errors_.grasp_null_space = (terms.G * F_N).cwiseAbs().maxCoeff() / size;

  // Slope of sum f_i3 - rho [sum log det P_i + sum log slack]: at the optimum it is in the range of G^T, so
  // that no internal force improves on F_N.
  double outside = 0.0;
  const double rho = barrier_weight_;
  for (Eigen::Index i = 0; i < f_c.size(); i += 3) {
    const double x = f_c[i], y = f_c[i + 1], z = f_c[i + 2];
    const double det = mu_ * mu_ * z * z - x * x - y * y;
    outside = std::max({outside, std::hypot(x, y) - mu_ * z, f_min_ - z, z - f_max_});
    slope_.segment<3>(i) << 2.0 * rho * x / det, 2.0 * rho * y / det,
        1.0 - 2.0 * rho * mu_ * mu_ * z / det - rho / (z - f_min_) + rho / (f_max_ - z);
  }
  errors_.grasp_cone = outside / size;
  if (outside <= 0.0) {
    const double whole = slope_.norm();
    const Vector6d y = reference_.SolveGrasp(slope_);
    slope_.noalias() -= terms.G.transpose() * y;
    errors_.grasp_optimality = slope_.norm() / std::max(whole, 1.0);
  }
}

void LawCheck::FollowError(const StepRecord& step, const StepFindings& findings, const LawTerms& terms,
                           const DesiredMotion& desired) {
  // The truth, which the law's terms need not be at.
  LawObject truth{terms.X_Bo, terms.V_Bo, terms.X_o};
  if (step.known != nullptr) {
    truth.X_Bo = step.reading.state.X_Bo;
    truth.V_Bo = step.reading.state.V_Bo;
    if (spec_.orientation == OrientationFeedback::kAngles)
      truth.X_o = CalcObjectCoordinates(truth.X_Bo, terms.X_o);
  }
  if (!follows_) {
    followed_.object = undisturbed_.object = held_.object = truth;
    follows_ = true;
  } else if (accelerates_within_step()) {
    FollowHeld(truth, desired);
  } else {
    Move(Vector6d::Zero(), &followed_);
    Move(Vector6d::Zero(), &undisturbed_);
  }
  before_ = {truth, step.response.V_Bo_dot};
  const Pose& X_Bo = undisturbed_.object.X_Bo;
  errors_.error_dynamics = (followed_.object.X_Bo.translation() - truth.X_Bo.translation()).norm();
  errors_.orientation_dynamics = CalcAngle(followed_.object.X_Bo.linear(), truth.X_Bo.linear());
  errors_.position_by_law = (X_Bo.translation() - desired.X_d.head<3>()).norm();
  errors_.orientation_by_law = CalcAngle(X_Bo.linear(), CalcObjectPose(desired.X_d).linear());
  if (accelerates_within_step()) {
    errors_.position_by_hold = (held_.object.X_Bo.translation() - X_Bo.translation()).norm();
    errors_.orientation_by_hold = CalcAngle(held_.object.X_Bo.linear(), X_Bo.linear());
  }
  for (Followed* one : {accelerates_within_step() ? &held_ : &followed_, &undisturbed_}) {
    if (spec_.orientation == OrientationFeedback::kAngles)
      one->object.X_o = CalcObjectCoordinates(one->object.X_Bo, one->object.X_o);
    one->V_dot = reference_.CalcDemand(spec_, one->object, desired);
  }
  // What the engine's object did beyond the rigid prediction. Where it is told otherwise, given otherwise and
  // pushed, all of that drives (57) as well: what it did beyond what its true error demands.
  followed_.V_dot +=
      step.response.V_Bo_dot -
      (step.known != nullptr ? reference_.CalcDemand(spec_, truth, desired) : findings.V_Bo_dot_model);
}

void LawCheck::FollowHeld(const LawObject& truth, const DesiredMotion& desired) {
  // (57) itself does not stand still within a step: Heun's method.
  Followed end = undisturbed_;
  Move(Vector6d::Zero(), &end);
  if (spec_.orientation == OrientationFeedback::kAngles)
    end.object.X_o = CalcObjectCoordinates(end.object.X_Bo, end.object.X_o);
  end.V_dot = reference_.CalcDemand(spec_, end.object, desired);
  Move(0.5 * (CalcWorldAcceleration(end) - CalcWorldAcceleration(undisturbed_)), &undisturbed_);
  // Mean acceleration of the plant, less that of the step's beginning.
  const LawObject& from = before_.object;
  Vector6d change = truth.V_Bo - from.V_Bo;
  change.head<3>() = truth.X_Bo.linear() * truth.V_Bo.head<3>() - from.X_Bo.linear() * from.V_Bo.head<3>();
  Move(change / time_step_ - CalcWorldAcceleration(before_), &held_);
}

Vector6d LawCheck::CalcWorldAcceleration(const Followed& one) {
  // v = R^T p_dot, hence p_ddot = R (v_dot + omega x v).
  Vector6d acceleration = one.V_dot;
  acceleration.head<3>() += one.object.V_Bo.tail<3>().cross(one.object.V_Bo.head<3>());
  acceleration.head<3>() = one.object.X_Bo.linear() * acceleration.head<3>().eval();
  return acceleration;
}

void LawCheck::Move(const Vector6d& change, Followed* one) const {
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

}  // namespace dexcheck
