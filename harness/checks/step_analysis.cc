#include "harness/checks/step_analysis.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <vector>

#include "harness/base/worst.h"
#include "harness/comparison/rounding_scales.h"
#include "harness/plant/plant.h"

namespace dexcheck {
namespace {

constexpr double kTiny = std::numeric_limits<double>::min();
/// Least scale relative to the motors' forces, where gravity does not act.
constexpr double kLeastBias = 1e-3;

double CalcRobotMass(const RobotModel& model) {
  double mass = model.base_with_wheels().mass;
  for (const Joint& joint : model.joints()) mass += joint.body.mass;
  return mass;
}

}  // namespace

Vector2d CalcRollingTwist(const Base& base, const VectorXd& xi) {
  const Vector2d velocity = xi.head<2>();
  return base.velocity == DriveVelocity::kTwist ? velocity : CalcTwist(base, velocity);
}

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
      dynamics_(setup.model(), static_cast<int>(setup.fingertips().size())) {
  const Eigen::Index n = setup.model().num_velocities();
  for (VectorXd* vector : {&applied_force_, &bias_, &now_.robot.residual, &now_.findings.xi_dot_model,
                           &acceleration_, &solver_force_, &joint_force_})
    vector->setZero(n);
  if (setup.scenario().plant.type != PlantType::kRigid) {
    const ObjectModel* const object = setup.has_object() ? &setup.declared_object() : nullptr;
    whole_ = std::make_unique<WholeRobot>(setup.declared_model(), object == nullptr ? nullptr : &object->body,
                                          setup.plant_adapter());
    if (ConstraintLaw::Applies(setup.engine())) {
      constraint_law_ = std::make_unique<ConstraintLaw>(setup.declared_model(), object, setup.plant_adapter(),
                                                        *whole_, setup.scenario().tolerance);
    }
    rolling_ = std::make_unique<VelocityMap>(setup.plant_adapter(), Coordinates::kReduced);
    for (VectorXd* vector : {&nu_dot_, &whole_residual_, &whole_size_, &whole_left_, &whole_pushed_})
      vector->setZero(whole_->size());
    engine_force_.setZero(setup.engine().nv);
  }
  const Eigen::Index entries = whole_ ? whole_->size() : n + (setup.has_object() ? 6 : 0);
  for (VectorXd* vector : {&now_.motion.residual, &now_.motion.size}) vector->setZero(entries);
  now_.contacts.mismatch.setZero(static_cast<Eigen::Index>(setup.fingertips().size()));
  least_ = RoundingScales(setup.model()).CalcLeastForces();
  now_.setup = &setup;
  now_.findings.f_c.setZero(3 * static_cast<Eigen::Index>(setup.fingertips().size()));
  now_.findings.f_c_model = now_.findings.f_c;
  now_.findings.fingertip_slip.resize(setup.fingertips().size());
  now_.findings.wheel_slip.resize(setup.adapter().wheels().size());
  const std::span<const int> feet = setup.feet();
  now_.findings.foot_slip.resize(feet.size());
  if (feet.empty()) return;
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
  steps_ = 0;
}

void StepAnalyzer::Begin(const StepRecord& step, const DeclaredStep& declared) {
  now_.step = &step;
  now_.declared = &declared;
  now_.law.reset();
  MeasureClearance();
}

void StepAnalyzer::SetLaw(const LawErrors& errors) {
  now_.law = errors;
  now_.by_hold = {errors.position_by_hold, errors.orientation_by_hold};
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

void StepAnalyzer::Analyze() {
  const StepRecord& step = *now_.step;
  FindContacts();
  FindTouching();
  if (ground_) FindFeet();
  if (step.response.wheels.size() == 2) CalcRolling();
  CalcContactBias();
  CalcAppliedForce();
  if (whole_) CalcWholeResidual();
  if (constraint_law_) {
    constraint_law_->SetStep(step.reading.qpos.data(), step.reading.qvel.data(), step.response);
    now_.whole.constraint = constraint_law_->FindWorst();
  }
  Predict();
  CalcRobotResidual();
  ComparePrediction();
  if (setup_->has_object()) CalcObjectResidual();
  if (!whole_) SetRigidMotion();
  now_.contacts.begins_holding = step.command.handling.holding && !was_holding_;
  was_holding_ = step.command.handling.holding;
  if (now_.contacts.begins_holding) ForgetSlip();
  FollowSlip();
  MoveWindow();
  ++steps_;
}

void StepAnalyzer::FindTouching() {
  const PlantResponse& response = now_.step->response;
  now_.contacts.touching = 0;
  for (size_t i = 0; i < response.contacts.size(); ++i) {
    if (response.contacts[i].touching) now_.contacts.touching |= ContactSet{1} << i;
  }
  for (size_t i = 0; i < response.feet.size(); ++i) {
    if (response.feet[i].force.z() > 0.0) now_.contacts.touching |= ContactSet{1} << (i % 32);
  }
}

void StepAnalyzer::CalcRolling() {
  const StepRecord& step = *now_.step;
  const Base& base = setup_->model().base();
  const Vector2d twist = CalcRollingTwist(base, step.reading.state.xi);
  const double turn = 0.5 * base.wheel_distance * twist[1];
  // A platform that tilts about the axle turns its wheels as well.
  Vector3d velocity, omega;
  setup_->adapter().GetBaseMotion(step.reading.qpos.data(), step.reading.qvel.data(), &velocity, &omega);
  const double tilting = omega.dot(step.reading.X_W0.linear().col(1));
  for (Eigen::Index k = 0; k < 2; ++k) {
    const EngineWheel& engine = setup_->adapter().wheels()[static_cast<size_t>(k)];
    const BodyContact& wheel = step.response.wheels[static_cast<size_t>(k)];
    now_.wheels.rates[k] = engine.axis.y() * step.reading.qvel[engine.dof] + tilting;
    now_.wheels.mismatch[k] = twist[0] + (k == 0 ? turn : -turn) - base.wheel_radius * now_.wheels.rates[k];
    // A tyre that gives rolls on a radius that is smaller by as much.
    now_.wheels.slip[k] = wheel.slip.norm() + Worst(0.0, -wheel.distance) * std::abs(now_.wheels.rates[k]);
  }
}

void StepAnalyzer::CalcContactBias() {
  VectorXd& bias = contact_bias_;
  if (ground_) {
    bias = ground_->J_dot_xi();
    return;
  }
  const GraspTerms& grasp = now_.grasp();
  const PlantOptions& plant = setup_->scenario().plant;
  bias = grasp.slip_bias();
  if (plant.type == PlantType::kRigid) {
    // A rigid plant holds (46) whole; half of it under semi-implicit Euler, whose velocities are half a step
    // old.
    bias *= plant.integrator == Integrator::kSemiImplicitEuler ? 0.5 : 0.0;
    return;
  }
  const Vector6d& V_Bo = grasp.V_Bo();
  Vector3d turning = V_Bo.tail<3>().cross(V_Bo.head<3>());
  if (setup_->model().base().type == BaseType::kDifferentialDrive) {
    const Vector6d V_B0 = now_.terms().CalcLinkVelocity(-1);
    turning -= now_.step->reading.state.X_Bo.linear().transpose() * V_B0.tail<3>().cross(V_B0.head<3>());
  }
  bias.noalias() += grasp.G().topRows<3>().transpose() * turning;
}

void StepAnalyzer::CalcAppliedForce() {
  VectorXd& force = applied_force_;
  actuation_.CalcForce(now_.step->drive.tau, force);
  force += now_.declared->force;
  joint_force_.setZero();
  const VectorXd& friction = now_.step->response.dry_friction;
  const VectorXd& limits = now_.step->response.stop_force;
  if (friction.size() == 0 && limits.size() == 0) return;
  const RobotModel& model = setup_->model();
  for (int k = 0; k < model.num_dofs(); ++k) {
    const int j = model.joint_of_dof(k);
    const Joint& joint = model.joint(j);
    const Eigen::Index entry = model.num_base_velocities() + k;
    // Friction counts up to the parameters' value, at their joints: other friction stays in the residual.
    if (friction.size() > 0)
      joint_force_[entry] += std::clamp(friction[entry], -joint.dry_friction, joint.dry_friction);
    if (limits.size() == 0 || joint.type == JointType::kBall) continue;
    const double q = now_.step->reading.state.q[model.position_index(j)];
    if (q < joint.lower || q > joint.upper) joint_force_[entry] += limits[entry];
  }
  force += joint_force_;
}

void StepAnalyzer::Predict() {
  if (ground_) return PredictStance();
  const bool whole = now_.contacts.touching == AllContacts(now_.grasp().num_contacts());
  const bool partial = now_.step->command.handling.partial;
  if (partial && !whole && now_.contacts.touching != 0) return PredictPart();
  const bool holds = now_.grasp().num_contacts() > 0;
  const Prediction* prediction = nullptr;
  if (holds && (!partial || (whole && !IsSupported()))) {
    prediction = &dynamics_.Predict(now_.terms(), now_.grasp(), applied_force_, ObjectSupport::kHand, nullptr,
                                    &now_.declared->object_wrench);
  } else if (holds && whole) {
    prediction = &dynamics_.Predict(now_.terms(), now_.grasp(), applied_force_, ObjectSupport::kAtRest);
  } else {
    prediction = &dynamics_.PredictFree(now_.terms(), applied_force_);
  }
  KeepPrediction(*prediction, dynamics_.mass_factor());
  now_.findings.f_c_model = prediction->f_c;
}

void StepAnalyzer::KeepPrediction(const Prediction& prediction, const TreeFactor& factor) {
  now_.findings.xi_dot_model = prediction.xi_dot;
  now_.findings.V_Bo_dot_model = prediction.V_Bo_dot;
  mass_factor_ = &factor;
}

void StepAnalyzer::PredictStance() {
  const Prediction& prediction = ground_dynamics_->Predict(now_.terms(), *ground_, applied_force_);
  KeepPrediction(prediction, ground_dynamics_->mass_factor());
  now_.findings.foot_force_model = prediction.f_c;
}

void StepAnalyzer::PredictPart() {
  std::unique_ptr<PartialDynamics>& part = parts_[now_.contacts.touching];
  if (!part) part = std::make_unique<PartialDynamics>(*setup_, now_.contacts.touching);
  part->grasp.SetState(now_.terms(), now_.step->reading.state);
  const Prediction& prediction = part->dynamics.Predict(
      now_.terms(), part->grasp.terms(), applied_force_,
      IsSupported() ? ObjectSupport::kAtRest : ObjectSupport::kHand, nullptr, &now_.declared->object_wrench);
  KeepPrediction(prediction, part->dynamics.mass_factor());
  part->grasp.Scatter(prediction.f_c, now_.findings.f_c_model);
}

void StepAnalyzer::CalcRobotResidual() {
  const PlantResponse& response = now_.step->response;
  bias_ = now_.terms().gravity() + now_.terms().friction();
  bias_.noalias() += now_.terms().C() * now_.terms().velocity();
  VectorXd& residual = now_.robot.residual;
  if (whole_ == nullptr) {
    // (48): M_bar' xi_dot + C_bar' xi + F_bar' + J_B'^T f_c - E_bar' tau'
    residual = bias_ - applied_force_;
    residual.noalias() += now_.terms().M() * response.xi_dot;
    residual.noalias() += now_.grasp().J_B().transpose() * now_.findings.f_c;
  }
  const double least = Worst(kLeastBias * Norm(applied_force_), Norm(least_));
  now_.robot.balanced = Worst(Norm(bias_), least, kTiny);
  now_.robot.error = Norm(residual) / now_.robot.balanced;
  now_.robot.solver = Norm(solver_force_) / now_.robot.balanced;
}

void StepAnalyzer::CalcWholeResidual() {
  const StepRecord& step = *now_.step;
  const PlantResponse& response = step.response;
  WholeRobot& whole = *whole_;
  const Eigen::Index n = whole.robot_size();
  whole.SetState(step.reading.qpos.data(), step.reading.qvel.data());
  whole.ReadRates(response.qacc.data(), &nu_dot_);
  whole.ReadForces(response.left_over.data(), &whole_left_);
  now_.whole.mass = whole.CompareMass(response.mass);
  now_.whole.bias = whole.CompareBias(response.bias);

  VectorXd& residual = whole_residual_;
  residual = whole.bias() - whole_left_;
  whole.AddInertia(nu_dot_, &residual);
  whole_size_ = whole_left_.cwiseAbs();
  whole.AddSizes(nu_dot_, &whole_size_);
  // The forces of motors, joint friction and joint limits are subtracted, as far as the parameters have them.
  const auto apply = [&](Eigen::Index entry, double force) {
    residual[entry] -= force;
    whole_size_[entry] += std::abs(force);
  };
  const std::vector<Eigen::Index>& entries = whole.motor_entries();
  for (size_t i = 0; i < entries.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    if (entries[i] >= 0) apply(entries[i], step.drive.tau[k] + joint_force_[k]);
  }
  whole.ClearForces();
  for (const BodyForce& force : response.forces) whole.AddForce(force);
  for (const Wrench& push : now_.declared->pushes) {
    const BodyForce force{-1, push.point, push.force, push.torque};
    push.body == Wrench::kObject ? whole.AddObjectForce(force) : whole.AddLinkForce(push.body, force);
  }
  whole_pushed_.setZero();
  whole.ProjectForces(&whole_pushed_, &whole_size_);
  residual -= whole_pushed_;
  now_.whole.residual = {0.0, -1};
  for (Eigen::Index i = 0; i < residual.size(); ++i) {
    const double left = std::abs(residual[i]) / Positive(whole_size_[i]);
    if (IsWorse(left, now_.whole.residual.first)) now_.whole.residual = {left, static_cast<int>(i)};
  }

  MotionBalance& motion = now_.motion;
  motion.q = whole.q();
  motion.nu = whole.nu().head(n);
  motion.nu_dot = nu_dot_.head(n);
  motion.residual = residual;
  motion.size = whole_size_;
  for (size_t i = 0; i < entries.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    if (entries[i] >= 0) motion.residual[entries[i]] += step.drive.tau[k] - response.motor_torques[k];
  }

  // (48) and (19): the same in the paper's coordinates.
  rolling_->SetState(step.reading.state.q, step.reading.state.xi);
  whole.WriteForces(residual, &engine_force_);
  rolling_->ProjectForce(engine_force_.data(), now_.robot.residual);
  rolling_->ProjectForce(response.left_over.data(), solver_force_);
  if (!setup_->has_object()) return;
  const Matrix3d R_oB = step.reading.state.X_Bo.linear().transpose();
  now_.object.residual << R_oB * residual.segment<3>(n), residual.tail<3>();
  motion.residual.tail<6>() = now_.object.residual;
  object_left_ << R_oB * whole_left_.segment<3>(n), whole_left_.tail<3>();
}

void StepAnalyzer::SetRigidMotion() {
  const StepRecord& step = *now_.step;
  MotionBalance& motion = now_.motion;
  const Eigen::Index n = now_.robot.residual.size();
  motion.q = step.reading.state.q;
  motion.nu = step.reading.state.xi;
  motion.nu_dot = step.response.xi_dot;
  acceleration_ = step.drive.tau - step.response.motor_torques;
  actuation_.CalcForce(acceleration_, motion.residual.head(n));
  motion.residual.head(n) += now_.robot.residual;
  // Rounding of equations that are solved together is that of the largest.
  constexpr double kTogether = 1e4;
  motion.size.head(n) = kTogether * now_.robot.balanced * now_.terms().M().diagonal().cwiseSqrt();
  if (!setup_->has_object()) return;
  const MassProperties& body = setup_->declared_object().body;
  motion.residual.tail<6>() = now_.object.residual;
  motion.size.segment<3>(n).setConstant(kTogether * now_.object.balanced);
  motion.size.tail<3>() = motion.size.segment<3>(n) * std::sqrt(body.inertia.trace() / body.mass);
}

void StepAnalyzer::ComparePrediction() {
  const StepFindings& findings = now_.findings;
  // |a|_M = |L a|
  acceleration_ = findings.xi_dot_model;
  mass_factor_->Multiply(acceleration_);
  const double predicted = acceleration_.norm();
  acceleration_ = findings.xi_dot_model - now_.step->response.xi_dot;
  mass_factor_->Multiply(acceleration_);
  now_.rigid.acceleration = acceleration_.norm() / Worst(now_.robot.balanced, predicted);
  if (ground_) {
    // The sum of the forces is xi_dot's where the rigid system does not determine the forces of single feet.
    const bool has_forces = ground_dynamics_->determines_forces();
    // The scale includes the weight, which feet that leave the ground should bear.
    const double weight = mass_ * setup_->model().gravity().norm();
    const double scale = Worst(findings.foot_force.norm(), weight, kTiny);
    now_.rigid.contact_force =
        has_forces ? (findings.foot_force_model - findings.foot_force).norm() / scale : 0.0;
    return;
  }
  double scale = Worst(findings.f_c.norm(), kTiny);
  // Fingertips that only touch push with less than their later load.
  if (now_.step->command.handling.partial) scale = Worst(scale, CalcWeight());
  now_.rigid.contact_force = (findings.f_c_model - findings.f_c).norm() / scale;
}

double StepAnalyzer::CalcWeight() const {
  return setup_->object().body.mass * setup_->model().gravity().norm();
}

void StepAnalyzer::CalcObjectResidual() {
  // (19), as forces at the contacts' arm
  const GraspTerms& grasp = now_.grasp();
  const PlantResponse& response = now_.step->response;
  const ObjectBodyTerms& body = grasp.body();
  // The arm is the radius of gyration of an object that is not held.
  const double arm = grasp.num_contacts() > 0
                         ? grasp.contacts()[0].geometry.g_o_cf.translation().norm()
                         : std::sqrt(body.M_hat.bottomRightCorner<3, 3>().trace() / body.M_hat(0, 0));
  now_.object.balanced = Worst(CalcWeight(), now_.findings.f_c.norm());
  const auto relative = [&](const Vector6d& wrench) {
    return Worst(wrench.head<3>().norm(), wrench.tail<3>().norm() / arm) / now_.object.balanced;
  };
  if (whole_ == nullptr) {
    now_.object.residual = body.M_hat * response.V_Bo_dot + body.C_hat * grasp.V_Bo() + body.N_o -
                           grasp.G() * now_.findings.f_c - response.support_wrench -
                           now_.declared->object_wrench;
  }
  now_.object.error = relative(now_.object.residual);
  now_.object.solver = relative(object_left_);
}

}  // namespace dexcheck
