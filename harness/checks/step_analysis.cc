#include "harness/checks/step_analysis.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <vector>

#include "harness/base/worst.h"
#include "harness/checks/rounding_scales.h"

namespace dexcheck {
namespace {

constexpr double kTiny = std::numeric_limits<double>::min();
/// Of the motors' forces, where gravity does not act.
constexpr double kLeastBias = 1e-3;

double CalcRobotMass(const RobotModel& model) {
  double mass = model.base_with_wheels().mass;
  for (const Joint& joint : model.joints()) mass += joint.body.mass;
  return mass;
}

}  // namespace

StepAnalyzer::PartialDynamics::PartialDynamics(const Setup& setup, ContactSet set)
    : grasp(setup.declared_model(), setup.fingertips(), setup.declared_model().object()->body,
            setup.surface(), set),
      dynamics(setup.declared_model(), static_cast<int>(grasp.members().size())) {}

StepAnalyzer::StepAnalyzer(const Setup& setup)
    : setup_(&setup),
      time_step_(setup.scenario().plant.time_step),
      mass_(CalcRobotMass(setup.model())),
      clearance_(setup.engine(), setup.plant_adapter(), setup.robots().solids, setup.robots().watched_pairs),
      kinematics_(MakeData(setup.engine())),
      actuation_(setup.model()),
      dynamics_(setup.model(), static_cast<int>(setup.fingertips().size())),
      compliance_(setup) {
  const Eigen::Index n = setup.model().num_velocities();
  for (VectorXd* vector : {&now_.applied_force, &now_.bias, &now_.robot_residual, &now_.findings.xi_dot_model,
                           &spin_force_, &held_force_, &moving_, &momentum_, &acceleration_error_})
    vector->setZero(n);
  now_.contact_mismatch.setZero(static_cast<Eigen::Index>(setup.fingertips().size()));
  least_ = RoundingScales(setup.model()).CalcLeastForces();
  now_.setup = &setup;
  now_.clearance = &clearance_;
  now_.findings.f_c.setZero(3 * static_cast<Eigen::Index>(setup.fingertips().size()));
  now_.findings.f_c_model = now_.findings.f_c;
  now_.findings.fingertip_slip.resize(setup.fingertips().size());
  now_.findings.wheel_slip.resize(setup.adapter().wheels().size());
  const std::span<const int> feet = setup.feet();
  now_.findings.foot_slip.resize(feet.size());
  if (feet.empty()) return;
  contact_count_ = static_cast<int>(feet.size());
  for (int i = 0; i < contact_count_; ++i) now_.touching |= ContactSet{1} << (i % 32);
  ground_ =
      std::make_unique<GroundContacts>(setup.declared_model(), feet, setup.joints()->gains.stance->height);
  ground_dynamics_ = std::make_unique<GroundDynamics>(setup.declared_model(), static_cast<int>(feet.size()));
  now_.findings.foot_force.setZero(3 * static_cast<Eigen::Index>(feet.size()));
  now_.findings.foot_force_model = now_.findings.foot_force;
}

void StepAnalyzer::Reset() {
  StepFindings& findings = now_.findings;
  ForgetSlip();
  for (std::vector<SlipState>* slips : {&findings.wheel_slip, &findings.foot_slip})
    std::ranges::fill(*slips, SlipState{});
  findings.contacts_lost = 0;
  findings.least_cone_margin = std::numeric_limits<double>::infinity();
  findings.excluded_steps = 0;
  steps_ = 0;
  now_.is_transient = false;
  changed_at_ = -std::numeric_limits<double>::infinity();
}

void StepAnalyzer::Begin(const StepRecord& step, const DeclaredStep& declared) {
  now_.step = &step;
  now_.declared = &declared;
  now_.robot = &declared.model->robot();
  now_.grasp = &declared.model->grasp();
  now_.law = nullptr;
  CompareMeasurement();
  MeasureClearance();
}

void StepAnalyzer::SetLaw(const LawErrors* errors) {
  now_.law = errors;
  now_.position_by_hold = errors->position_by_hold;
  now_.orientation_by_hold = errors->orientation_by_hold;
}

void StepAnalyzer::CompareMeasurement() {
  const Reading& measured = now_.step->measured;
  const Reading& declared = now_.declared->measured;
  double apart = std::abs(measured.touch.support_force - declared.touch.support_force);
  if (measured.touch.fingertips != declared.touch.fingertips) apart = std::numeric_limits<double>::infinity();
  const MeasuredState& a = measured.state;
  const MeasuredState& b = declared.state;
  apart = Worst(apart, MaxAbs(a.q - b.q));
  apart = Worst(apart, MaxAbs(a.xi - b.xi));
  apart = Worst(apart, MaxAbs(a.X_Bo.matrix() - b.X_Bo.matrix()));
  apart = Worst(apart, MaxAbs(a.V_Bo - b.V_Bo));
  for (size_t i = 0; i < b.kappa.size(); ++i) {
    const ContactCoordinates &x = a.kappa[i], &y = b.kappa[i];
    apart = Worst(apart, MaxAbs(x.CalcVector() - y.CalcVector()), std::abs(a.overlap[i] - b.overlap[i]));
    if (x.alpha_f.chart != y.alpha_f.chart || x.alpha_o.chart != y.alpha_o.chart)
      apart = std::numeric_limits<double>::infinity();
  }
  now_.measurement_error = apart;
}

void StepAnalyzer::MeasureClearance() {
  if (clearance_.pairs().empty()) return;
  const PlantReading& reading = now_.step->reading;
  now_.deepest_overlap = {kNaN, -1};
  if (!reading.body_positions.allFinite() || !reading.body_rotations.allFinite() || !reading.qpos.allFinite())
    return;
  if (reading.body_positions.size() > 0) {
    clearance_.Update({reading.body_positions.data(), reading.body_rotations.data()}, now_.step->time);
  } else {
    std::copy_n(reading.qpos.data(), reading.qpos.size(), kinematics_->qpos);
    mj_kinematics(&setup_->engine(), kinematics_.get());
    clearance_.Update({kinematics_->xpos, kinematics_->xmat}, now_.step->time);
  }
  now_.deepest_overlap = clearance_.FindDeepest();
}

void StepAnalyzer::CompareMotors() {
  now_.torque_error = MaxAbs(now_.step->response.motor_torques - now_.declared->tau) /
                      Worst(MaxAbs(now_.step->command.tau), kTiny);
}

void StepAnalyzer::Analyze() {
  const StepRecord& step = *now_.step;
  CompareMotors();
  FindContacts();
  FindTransient();
  if (ground_) FindFeet();
  if (step.response.wheels.size() == 2) {
    const std::vector<EngineWheel>& wheels = setup_->adapter().wheels();
    now_.wheel_rates = {wheels[0].axis.y() * step.reading.qvel[wheels[0].dof],
                        wheels[1].axis.y() * step.reading.qvel[wheels[1].dof]};
    now_.wheel_mismatch =
        CalcRollingMismatch(setup_->model().base(), step.reading.state.xi, now_.wheel_rates);
    // A tyre that gives rolls on a radius that is smaller by as much.
    for (Eigen::Index k = 0; k < 2; ++k) {
      const BodyContact& wheel = step.response.wheels[static_cast<size_t>(k)];
      now_.wheel_slip[k] = wheel.slip.norm() + Worst(0.0, -wheel.distance) * std::abs(now_.wheel_rates[k]);
    }
  }
  CalcContactBias(*setup_, step, *now_.declared->model, &now_.contact_bias);
  // The engine constrains J xi_dot, where the model has J xi_dot + J_dot xi.
  if (ground_) now_.contact_bias = ground_->J_dot_xi();
  CalcAppliedForce();
  // Soft contacts become only in some milliseconds what rigid ones are at once.
  if (!now_.is_transient) Predict();
  if (now_.mass_factor != nullptr) CalcRobotResidual();
  if (now_.mass_factor != nullptr && !now_.is_transient) ComparePrediction();
  if (setup_->has_object()) CalcObjectResidual();
  now_.begins_holding = step.command.handling.holding && !was_holding_;
  was_holding_ = step.command.handling.holding;
  if (now_.begins_holding) ForgetSlip();
  FollowSlip();
  MoveWindow();
  ++steps_;
}

void StepAnalyzer::FindTransient() {
  const Handling& handling = now_.step->command.handling;
  const double time = now_.step->time;
  ContactSet touching = 0;
  const std::vector<PlantContact>& contacts = now_.step->response.contacts;
  for (size_t i = 0; i < contacts.size(); ++i) {
    if (contacts[i].touching) touching |= ContactSet{1} << i;
  }
  const std::vector<GroundContact>& feet = now_.step->response.feet;
  for (size_t i = 0; i < feet.size(); ++i) {
    if (feet[i].force.z() > 0.0) touching |= ContactSet{1} << (i % 32);
  }
  const PlantResponse& response = now_.step->response;
  const bool is_supported = !response.support_wrench.isZero(0.0);
  // What is put down touches at one point, then at more; of feet of several points one may lift a little.
  if (handling.contacts != handling_.contacts || touching != now_.touching ||
      is_supported != now_.is_supported || response.contact_count != contact_count_)
    changed_at_ = time;
  contact_count_ = response.contact_count;
  handling_ = handling;
  now_.touching = touching;
  now_.is_supported = is_supported;
  const bool is_transient = (handling.partial || ground_) && time - changed_at_ < kTransient;
  if (is_transient && !now_.is_transient) transient_since_ = time;
  now_.is_transient = is_transient;
  now_.transient_time = is_transient ? time - transient_since_ : 0.0;
  if (is_transient) ++now_.findings.excluded_steps;
}

void StepAnalyzer::CalcAppliedForce() {
  VectorXd& force = now_.applied_force;
  actuation_.CalcForce(now_.step->drive.tau, force);
  force += now_.declared->force;
  const VectorXd& friction = now_.step->response.dry_friction;
  const VectorXd& limits = now_.step->response.stop_force;
  if (friction.size() == 0 && limits.size() == 0) return;
  const RobotModel& model = setup_->model();
  for (int k = 0; k < model.num_dofs(); ++k) {
    const int j = model.joint_of_dof(k);
    const Joint& joint = model.joint(j);
    const Eigen::Index entry = model.num_base_velocities() + k;
    // No more than the parameters say, and where they say: what else is there stays to be found.
    if (friction.size() > 0)
      force[entry] += std::clamp(friction[entry], -joint.dry_friction, joint.dry_friction);
    if (limits.size() == 0 || joint.type == JointType::kBall) continue;
    const double q = now_.step->reading.state.q[model.position_index(j)];
    if (q < joint.lower || q > joint.upper) force[entry] += limits[entry];
  }
}

void StepAnalyzer::Predict() {
  if (ground_) return PredictStance();
  const bool whole = now_.touching == AllContacts(now_.grasp->num_contacts());
  if (handling_.partial && !whole && now_.touching != 0) return PredictPart();
  const bool holds = now_.grasp->num_contacts() > 0;
  const Prediction* prediction = nullptr;
  if (holds && (!handling_.partial || (whole && !now_.is_supported))) {
    prediction = &dynamics_.Predict(*now_.robot, *now_.grasp, now_.applied_force, ObjectSupport::kHand,
                                    nullptr, &now_.declared->object_wrench);
  } else if (holds && whole) {
    prediction = &dynamics_.Predict(*now_.robot, *now_.grasp, now_.applied_force, ObjectSupport::kAtRest);
  } else {
    prediction = &dynamics_.PredictFree(*now_.robot, now_.applied_force);
  }
  now_.findings.xi_dot_model = prediction->xi_dot;
  now_.findings.V_Bo_dot_model = prediction->V_Bo_dot;
  now_.findings.f_c_model = prediction->f_c;
  now_.mass_factor = &dynamics_.mass_factor();
}

void StepAnalyzer::PredictStance() {
  const Prediction& prediction = ground_dynamics_->Predict(*now_.robot, *ground_, now_.applied_force);
  now_.findings.xi_dot_model = prediction.xi_dot;
  now_.findings.foot_force_model = prediction.f_c;
  now_.mass_factor = &ground_dynamics_->mass_factor();
}

void StepAnalyzer::PredictPart() {
  std::unique_ptr<PartialDynamics>& part = parts_[now_.touching];
  if (!part) part = std::make_unique<PartialDynamics>(*setup_, now_.touching);
  part->grasp.SetState(*now_.robot, now_.step->reading.state);
  const Prediction& prediction =
      part->dynamics.Predict(*now_.robot, part->grasp.terms(), now_.applied_force,
                             now_.is_supported ? ObjectSupport::kAtRest : ObjectSupport::kHand, nullptr,
                             &now_.declared->object_wrench);
  now_.findings.xi_dot_model = prediction.xi_dot;
  now_.findings.V_Bo_dot_model = prediction.V_Bo_dot;
  part->grasp.Scatter(prediction.f_c, now_.findings.f_c_model);
  now_.mass_factor = &part->dynamics.mass_factor();
}

void StepAnalyzer::CalcRobotResidual() {
  const PlantResponse& response = now_.step->response;
  now_.bias = now_.robot->gravity() + now_.robot->friction();
  now_.bias.noalias() += now_.robot->C() * now_.robot->velocity();
  // (48): M_bar' xi_dot + C_bar' xi + F_bar' + J_B'^T f_c - E_bar' tau'
  VectorXd& residual = now_.robot_residual;
  residual = now_.bias - now_.applied_force;
  residual.noalias() += now_.robot->M() * response.xi_dot;
  residual.noalias() += now_.grasp->J_B().transpose() * now_.findings.f_c;
  if (ground_) residual.noalias() -= ground_->J().transpose() * now_.findings.foot_force;
  if (response.departure_force.size() > 0) residual += response.departure_force;
  if (response.solver_force.size() > 0) residual -= response.solver_force;
  if (response.wheels.size() == 2) {
    // Friction of wheels that spin, which (48) has at the rates of (1): r (thetadot - thetadot of a wheel
    // that rolls) is what is left of (1), the other way round.
    spin_force_.setZero();
    for (Eigen::Index k = 0; k < 2; ++k) {
      const double damping =
          setup_->engine().dof_damping[setup_->adapter().wheels()[static_cast<size_t>(k)].dof];
      spin_force_[k] = -damping * now_.wheel_mismatch[k] / setup_->model().base().wheel_radius;
    }
    actuation_.CalcForce(spin_force_, spin_force_);
    residual += spin_force_;
  }
  const double least = Worst(kLeastBias * Norm(now_.applied_force), Norm(least_));
  now_.balanced = Worst(Norm(now_.bias), least, kTiny);
  now_.robot_residual_norm = Norm(residual);
  now_.uneven_force = CalcUnevenForce() + CalcSwingForce();
  now_.robot_solver = response.solver_force.size() > 0 ? Norm(response.solver_force) / now_.balanced : 0.0;
  held_force_ = now_.bias - now_.applied_force;
  compliance_.Follow(*now_.step, *now_.declared, now_.contact_bias, held_force_, now_.findings.f_c_model,
                     now_.uneven_force, [this](const VectorXd& f) { return Norm(f); });
  now_.acceleration_compliance = compliance_.motion() / now_.balanced;
  now_.sinking = compliance_.sinking();
}

double StepAnalyzer::CalcUnevenForce() {
  // In |.|_M^-1 the force of an acceleration a that all masses feel is at most a sqrt(m): a tilt by theta
  // gives gravity g theta along the floor, and tyres that slip by v in a turn at w give 2 v w.
  const StepRecord& step = *now_.step;
  double slip = 0.0;
  for (const BodyContact& wheel : step.response.wheels) slip = Worst(slip, wheel.slip.norm());
  const double turn = step.response.wheels.empty()
                          ? 0.0
                          : std::abs(CalcRollingTwist(setup_->model().base(), step.reading.state.xi)[1]);
  const double g = setup_->model().gravity().norm();
  // Traction acts in the middle of how far a tyre has sunk, and not at the whole radius: f_t / r times half
  // of that, with the robot's weight on a floor of mu <= 1.
  double sunk = 0.0;
  for (const BodyContact& wheel : step.response.wheels)
    sunk += Worst(0.0, -0.5 * wheel.distance) * wheel.cone_use;
  if (sunk > 0.0) {
    sunk *=
        mass_ * g / setup_->model().base().wheel_radius / std::sqrt(setup_->model().base_with_wheels().mass);
  }
  return (g * step.reading.departure.tilt + 2.0 * slip * turn) * std::sqrt(mass_) + sunk;
}

double StepAnalyzer::CalcSwingForce() {
  // A platform that tilts at a rate gives all that turns with it, or moves on it, at v a Coriolis
  // acceleration of at most twice that rate times |v|. Over all masses |v| is |.|_M of xi without the way
  // forward, sqrt(2 E) of its kinetic energy.
  const StepRecord& step = *now_.step;
  if (step.response.wheels.size() != 2) return 0.0;
  moving_ = step.reading.state.xi;
  if (setup_->model().base().velocity == DriveVelocity::kTwist) {
    moving_[0] = 0.0;
  } else {
    moving_.head<2>().array() -= moving_.head<2>().mean();
  }
  momentum_.noalias() = now_.robot->M() * moving_;
  Vector3d velocity, omega;
  setup_->adapter().GetBaseMotion(step.reading.qpos.data(), step.reading.qvel.data(), &velocity, &omega);
  return 2.0 * omega.head<2>().norm() * std::sqrt(Worst(0.0, moving_.dot(momentum_)));
}

void StepAnalyzer::ComparePrediction() {
  const StepFindings& findings = now_.findings;
  // |a|_M = |L a|
  acceleration_error_ = findings.xi_dot_model - now_.step->response.xi_dot;
  now_.mass_factor->Multiply(acceleration_error_);
  now_.acceleration_error = acceleration_error_.norm() / now_.balanced;
  if (ground_) {
    // Where the rigid system does not determine the forces of single feet, their sum is xi_dot's.
    const bool has_forces = ground_dynamics_->determines_forces();
    // Of feet that leave the ground, what they should bear.
    const double weight = mass_ * setup_->model().gravity().norm();
    const double scale = Worst(findings.foot_force.norm(), weight, kTiny);
    now_.contact_force_error =
        has_forces ? (findings.foot_force_model - findings.foot_force).norm() / scale : 0.0;
    // J^T (f - f_model) is M_bar' times the accelerations' error.
    now_.contact_force_compliance =
        has_forces ? ground_dynamics_->CalcForceGain() * compliance_.motion() / scale : 0.0;
    return;
  }
  double scale = Worst(findings.f_c.norm(), kTiny);
  // Fingertips that only touch push with less than what they will bear.
  if (handling_.partial) scale = Worst(scale, CalcWeight());
  now_.contact_force_error = (findings.f_c_model - findings.f_c).norm() / scale;
  now_.contact_force_compliance = compliance_.force() / scale;
}

double StepAnalyzer::CalcWeight() const {
  return setup_->object().body.mass * setup_->model().gravity().norm();
}

void StepAnalyzer::CalcObjectResidual() {
  // (19), as forces at the contacts' arm
  const GraspTerms& grasp = *now_.grasp;
  const PlantResponse& response = now_.step->response;
  const ObjectBodyTerms& body = grasp.body();
  // Of an object that is not held, its radius of gyration.
  const double arm = grasp.num_contacts() > 0
                         ? grasp.contacts()[0].geometry.g_o_cf.translation().norm()
                         : std::sqrt(body.M_hat.bottomRightCorner<3, 3>().trace() / body.M_hat(0, 0));
  const auto relative = [&](const Vector6d& wrench) {
    return Worst(wrench.head<3>().norm(), wrench.tail<3>().norm() / arm) /
           Worst(CalcWeight(), now_.findings.f_c.norm());
  };
  now_.object_residual = body.M_hat * response.V_Bo_dot + body.C_hat * grasp.V_Bo() + body.N_o -
                         grasp.G() * now_.findings.f_c - response.support_wrench - response.solver_residual -
                         now_.declared->object_wrench;
  now_.object_residual_size = relative(now_.object_residual);
  now_.object_solver = relative(response.solver_residual);
}

}  // namespace dexcheck
