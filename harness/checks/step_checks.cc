#include "harness/checks/step_checks.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <stdexcept>

#include "controller/common/text.h"
#include "harness/checks/bounds.h"
#include "harness/checks/contact_compliance.h"
#include "harness/checks/known_plant.h"

namespace dexcheck {
namespace {

/// Null for none.
const Vector6d* PushOf(const StepRecord& step) {
  return step.known != nullptr ? &step.known->object_wrench : nullptr;
}

/// A platform that tilts at a rate gives all that turns with it, or moves on it, at v a Coriolis acceleration
/// of at most twice that rate times |v|. Over all masses |v| is |.|_M of xi without the way forward, sqrt(2
/// E) of its kinetic energy. @param v, momentum (n) scratch.
double CalcSwingForce(const Setup& setup, const StepRecord& step, VectorXd* v, VectorXd* momentum) {
  if (step.response.wheels.size() != 2) return 0.0;
  *v = step.reading.state.xi;
  if (setup.model().base().velocity == DriveVelocity::kTwist) {
    (*v)[0] = 0.0;
  } else {
    v->head<2>().array() -= v->head<2>().mean();
  }
  momentum->noalias() = ModelAtTrueState(step).robot().M() * *v;
  Vector3d velocity, omega;
  setup.adapter().GetBaseMotion(step.reading.qpos.data(), step.reading.qvel.data(), &velocity, &omega);
  return 2.0 * omega.head<2>().norm() * std::sqrt(std::max(0.0, v->dot(*momentum)));
}

}  // namespace

StepChecks::PartialDynamics::PartialDynamics(const Setup& setup, ContactSet set)
    : grasp(setup.declared_model(), setup.fingertips(), setup.declared_model().object()->body,
            setup.surface(), set),
      dynamics(setup.declared_model(), static_cast<int>(grasp.members().size())) {}

StepChecks::StepChecks(const Setup& setup)
    : setup_(&setup),
      dynamics_(setup.model(), static_cast<int>(setup.fingertips().size())),
      actuation_(setup.model()),
      time_step_(setup.scenario().plant.time_step),
      compliance_(std::make_unique<PredictionCompliance>(setup)),
      forces_(setup.model()),
      wheels_(setup.model().base()) {
  DefineChecks();
  mass_ = setup.model().base_with_wheels().mass;
  for (const Joint& joint : setup.model().joints()) mass_ += joint.body.mass;
  findings_.fingertip_slip.resize(setup.fingertips().size());
  findings_.wheel_slip.resize(setup.adapter().wheels().size());
  const int n = setup.model().num_velocities();
  findings_.f_c.setZero(3 * static_cast<Eigen::Index>(setup.fingertips().size()));
  findings_.f_c_model = findings_.f_c;
  findings_.xi_dot_model.setZero(n);
  force_.setZero(n);
  bias_.setZero(n);
  residual_.setZero(n);
  work_.setZero(n);
  left_of_robot_.setZero(n);
  idle_start_.setZero(static_cast<Eigen::Index>(setup.hold().idle_joints.size()));
  kappa_.resize(setup.fingertips().size());
  next_kappa_ = kappa_;
  last_contacts_.resize(kappa_.size());
}

StepChecks::~StepChecks() = default;

void StepChecks::DefineChecks() {
  const bool bonded = !setup_->start().bonds.empty();
  const bool moves_joints = setup_->scenario().joint_task() != nullptr;
  for (const StepCheckInfo& info : kStepChecks) {
    CheckRecord check;
    check.name = info.name;
    check.kind = info.kind;
    check.unit = info.unit;
    check.bound = CalcBound(info, setup_->scenario());
    check.description = moves_joints                                 ? info.joint_description
                        : bonded && *info.bonded_description != '\0' ? info.bonded_description
                                                                     : info.description;
    check.applies = !bonded || *info.bonded_description != '\0';
    checks_.push_back(check);
  }
  SetApplying();
  const Expectation& expect = setup_->scenario().expect;
  check(StepCheck::kExpectPosition).bound = expect.position.value_or(0.0);
  check(StepCheck::kExpectPosition).applies = expect.position.has_value();
  check(StepCheck::kExpectOrientation).bound = expect.orientation.value_or(0.0);
  check(StepCheck::kExpectOrientation).applies = expect.orientation.has_value();
  check(StepCheck::kExpectJoints).bound = expect.joints.value_or(0.0);
  check(StepCheck::kExpectJoints).applies = expect.joints.has_value();
  RequireKnownBounds(setup_->scenario());
  for (const BoundOverride& stated : setup_->scenario().bounds) {
    const StepCheckInfo& info = *FindStepCheck(stated.first);
    check(info.check).bound = CalcStatedBound(info, stated, setup_->scenario());
  }
}

void StepChecks::SetApplying() {
  const auto leave_out = [&](bool leave, std::initializer_list<StepCheck> checks) {
    for (const StepCheck which : checks) check(which).applies = check(which).applies && !leave;
  };
  using enum StepCheck;
  // Without a task every step is judged.
  leave_out(setup_->scenario().pick_task() == nullptr, {kExcluded});
  leave_out(setup_->adapter().wheels().empty(), {kWheelSlip, kWheelSlipRate, kRolling, kTractionUse});
  leave_out(setup_->model().base().type == BaseType::kFixed, {kBaseTilt});
  const bool joints = setup_->joints() != nullptr;
  leave_out(joints, {kLawDemand, kGraspNullSpace, kGraspCone, kGraspOptimality, kErrorDynamics,
                     kOrientationDynamics, kContactForce, kFingertipSlip, kFingertipSlipRate, kConeUse,
                     kContactsLost, kPenetration, kKappa});
  leave_out(!joints, {kJointDynamics});
  leave_out(!setup_->scenario().grasp.hemisphere, {kFingertipRim});
  leave_out(!setup_->has_object(), {kInverseDynamicsObject});
  // Nothing but stiffness holds them: whatever is not ideal moves them, and so do the Coriolis forces and the
  // friction that kPdGravity leaves to it. The least motion in the metric of M_bar' has them in it.
  const ControlOptions& control = setup_->scenario().control;
  const bool moves_idle = control.law == ControlLaw::kPdGravity ||
                          control.law == ControlLaw::kOperationalSpace ||
                          control.weight == RedundancyWeight::Kind::kMass;
  leave_out(setup_->hold().idle_joints.empty() || !setup_->scenario().imperfections.is_ideal() || moves_idle,
            {kIdleJoints});
  // A rigid plant's wheels roll, its base is upright and its equations are solved, whatever happens.
  leave_out(setup_->scenario().plant.type == PlantType::kRigid,
            {kWheelSlip, kRolling, kWheelSlipRate, kTractionUse, kBaseTilt, kSolver});
  leave_out(setup_->robots().watched_pairs.empty(), {kClearance, kCollision});
  leave_out(!setup_->scenario().plant.collide, {kCollision});
  const mjModel& engine = setup_->engine();
  const auto* const limited = engine.actuator_ctrllimited;
  leave_out(std::none_of(limited, limited + engine.nu, [](auto flag) { return flag != 0; }), {kActuators});
}

void StepChecks::RequireKnownBounds(const Scenario& scenario) {
  for (const auto& [name, bound] : scenario.bounds) {
    if (FindStepCheck(name) != nullptr) continue;
    throw InputError(scenario.source + ": bounds." + name + ": no check has this name");
  }
}

void StepChecks::Reset() {
  for (CheckRecord& check : checks_) check.Reset();
  ForgetSlip();
  std::fill(findings_.wheel_slip.begin(), findings_.wheel_slip.end(), SlipState{});
  findings_.contacts_lost = 0;
  findings_.least_cone_margin = std::numeric_limits<double>::infinity();
  findings_.excluded_steps = 0;
  steps_ = 0;
  is_excluded_ = false;
  changed_at_ = -std::numeric_limits<double>::infinity();
}

const CheckRecord& StepChecks::Find(std::string_view name) const {
  for (const CheckRecord& check : checks_) {
    if (check.name == name) return check;
  }
  throw std::invalid_argument("no check " + Quote(name));
}

void StepChecks::Compare(const StepRecord& step) {
  const Handling& handling = step.command.handling;
  time_ = step.time;
  CompareContacts(step);
  FindContacts(step);
  const bool excluded = handling.partial && time_ - changed_at_ < kTransient;
  if (excluded && !is_excluded_) excluded_since_ = time_;
  is_excluded_ = excluded;
  Add(StepCheck::kExcluded, excluded ? time_ - excluded_since_ : 0.0);
  if (excluded) ++findings_.excluded_steps;
  CompareDynamics(step);
  CompareObject(step);
  KeepForces(step);
  if (handling.holding && !was_holding_) ForgetSlip();
  was_holding_ = handling.holding;
  ReadSlip(step);
  if (step.response.wheels.size() == 2) CompareRolling(step);
  if (handling.holding) CompareKappa(step);
  MoveWindows(step.reading.state);
  if (handling.holding && check(StepCheck::kFingertipRim).applies) CheckRims(step);

  Add(StepCheck::kBaseTilt, step.reading.departure.tilt);
  CheckIdleJoints(step.reading.state);
  CheckJointLimits(step.reading.state);
  ++steps_;
}

void StepChecks::CheckIdleJoints(const MeasuredState& state) {
  double idle = 0.0;
  const std::vector<int>& joints = setup_->hold().idle_joints;
  const int offset = setup_->model().num_base_positions();
  for (size_t i = 0; i < joints.size(); ++i) {
    const double q = state.q[offset + joints[i]];
    double& start = idle_start_[static_cast<Eigen::Index>(i)];
    if (steps_ == 0) start = q;
    idle = std::max(idle, std::abs(q - start));
  }
  Add(StepCheck::kIdleJoints, idle);
}

void StepChecks::FindContacts(const StepRecord& step) {
  const Handling& handling = step.command.handling;
  if (handling.contacts != handling_.contacts) changed_at_ = time_;
  handling_ = handling;
  ContactSet touching = 0;
  for (size_t i = 0; i < step.response.contacts.size(); ++i) {
    if (step.response.contacts[i].touching) touching |= ContactSet{1} << i;
  }
  const bool supported = !step.response.support_wrench.isZero(0.0);
  if (touching != touching_ || supported != supported_) changed_at_ = time_;
  touching_ = touching;
  supported_ = supported;
}

void StepChecks::Predict(const StepRecord& step) {
  const ModelTerms& robot = ModelAtTrueState(step).robot();
  const GraspTerms& grasp = ModelAtTrueState(step).grasp();
  const bool whole = touching_ == AllContacts(grasp.num_contacts());
  if (handling_.partial && !whole && touching_ != 0) return PredictPart(step);
  const bool in_hand = grasp.num_contacts() > 0 && (!handling_.partial || (whole && !supported_));
  const Prediction* prediction = nullptr;
  if (in_hand) {
    prediction = &dynamics_.Predict(robot, grasp, force_, ObjectSupport::kHand, nullptr, PushOf(step));
  } else if (grasp.num_contacts() > 0 && whole) {
    prediction = &dynamics_.Predict(robot, grasp, force_, ObjectSupport::kAtRest);
  } else {
    prediction = &dynamics_.PredictFree(robot, force_);
  }
  findings_.xi_dot_model = prediction->xi_dot;
  findings_.V_Bo_dot_model = prediction->V_Bo_dot;
  findings_.f_c_model = prediction->f_c;
  predicted_by_ = &dynamics_;
}

void StepChecks::PredictPart(const StepRecord& step) {
  const ModelTerms& robot = ModelAtTrueState(step).robot();
  std::unique_ptr<PartialDynamics>& part = parts_[touching_];
  if (!part) part = std::make_unique<PartialDynamics>(*setup_, touching_);
  part->grasp.SetState(robot, step.reading.state);
  const Prediction& prediction = part->dynamics.Predict(
      robot, part->grasp.terms(), force_, supported_ ? ObjectSupport::kAtRest : ObjectSupport::kHand, nullptr,
      PushOf(step));
  findings_.xi_dot_model = prediction.xi_dot;
  findings_.V_Bo_dot_model = prediction.V_Bo_dot;
  part->grasp.Scatter(prediction.f_c, findings_.f_c_model);
  predicted_by_ = &part->dynamics;
}

void StepChecks::CompareDynamics(const StepRecord& step) {
  const ModelTerms& robot = ModelAtTrueState(step).robot();
  const VectorXd& xi_dot = step.response.xi_dot;
  actuation_.CalcForce(step.drive.tau, force_);
  if (step.known != nullptr) force_ += step.known->force;
  AddFrictionAndStops(step);
  // Soft contacts become only in some milliseconds what rigid ones are at once.
  if (!is_excluded_) Predict(step);
  if (mass_factor() == nullptr) return;

  // (48): M_bar' xi_dot + C_bar' xi + F_bar' + J_B'^T f_c - E_bar' tau'
  if (is_excluded_) {
    bias_ = robot.gravity() + robot.friction();
    bias_.noalias() += robot.C() * robot.velocity();
  } else {
    bias_ = predicted_by_->bias();
  }
  residual_ = bias_ - force_;
  residual_.noalias() += robot.M() * xi_dot;
  residual_.noalias() += ModelAtTrueState(step).grasp().J_B().transpose() * findings_.f_c;
  if (step.response.departure_force.size() > 0) residual_ += step.response.departure_force;
  if (step.response.solver_force.size() > 0) residual_ -= step.response.solver_force;
  if (step.response.wheels.size() == 2) AddSpin(step);
  left_of_robot_ = residual_;
  scale_ = std::max(Norm(bias_), std::numeric_limits<double>::min());
  const double left = Norm(residual_);
  const double uneven = CalcUnevenForce(step) + CalcSwingForce(*setup_, step, &work_, &residual_);
  Add(StepCheck::kInverseDynamicsRobot, std::isnan(left) ? left : std::max(0.0, left - uneven) / scale_);
  solver_of_robot_ = step.response.solver_force.size() > 0 ? Norm(step.response.solver_force) / scale_ : 0.0;
  bias_ -= force_;
  compliance_->Follow(step, bias_, findings_.f_c_model, uneven,
                      [this](const VectorXd& f) { return Norm(f); });

  if (is_excluded_) return;
  // |a|_M = |L a|
  residual_ = findings_.xi_dot_model - xi_dot;
  mass_factor()->Multiply(residual_);
  AddLess(StepCheck::kReducedAcceleration, residual_.norm() / scale_, compliance_->motion() / scale_, time_);
  double force_scale = std::max(findings_.f_c.norm(), std::numeric_limits<double>::min());
  // Fingertips that only touch push with less than what they will bear.
  if (handling_.partial) force_scale = std::max(force_scale, Weight());
  const double apart = (findings_.f_c_model - findings_.f_c).norm();
  AddLess(StepCheck::kContactForce, apart / force_scale, compliance_->force() / force_scale, time_);
}

void StepChecks::AddFrictionAndStops(const StepRecord& step) {
  const VectorXd& friction = step.response.dry_friction;
  const VectorXd& stops = step.response.stop_force;
  if (friction.size() == 0 && stops.size() == 0) return;
  const RobotModel& model = setup_->model();
  const int offset = model.num_base_positions();
  for (int i = 0; i < model.num_joints(); ++i) {
    const Joint& joint = model.joints()[static_cast<size_t>(i)];
    const Eigen::Index entry = model.num_base_velocities() + i;
    // No more than the parameters say, and where they say: what else is there stays to be found.
    if (friction.size() > 0)
      force_[entry] += std::clamp(friction[entry], -joint.dry_friction, joint.dry_friction);
    const double q = step.reading.state.q[offset + i];
    if (stops.size() > 0 && (q < joint.lower || q > joint.upper)) force_[entry] += stops[entry];
  }
}

double StepChecks::Norm(const VectorXd& force) { return mass_factor()->CalcForceNorm(force, &work_); }

Vector2d StepChecks::ReadWheelRates(const StepRecord& step) const {
  const std::vector<EngineWheel>& wheels = setup_->adapter().wheels();
  return {wheels[0].axis.y() * step.reading.qvel[wheels[0].dof],
          wheels[1].axis.y() * step.reading.qvel[wheels[1].dof]};
}

void StepChecks::AddSpin(const StepRecord& step) {
  // r (thetadot - thetadot of a wheel that rolls) is what is left of (1), the other way round.
  const Vector2d mismatch = wheels_.CalcMismatch(step.reading.state.xi, ReadWheelRates(step));
  left_of_robot_.setZero();
  for (Eigen::Index k = 0; k < 2; ++k) {
    const double damping =
        setup_->engine().dof_damping[setup_->adapter().wheels()[static_cast<size_t>(k)].dof];
    left_of_robot_[k] = -damping * mismatch[k] / setup_->model().base().wheel_radius;
  }
  actuation_.CalcForce(left_of_robot_, left_of_robot_);
  residual_ += left_of_robot_;
}

double StepChecks::CalcUnevenForce(const StepRecord& step) const {
  // In |.|_M^-1 the force of an acceleration a that all masses feel is at most a sqrt(m): a tilt by theta
  // gives gravity g theta along the floor, and tyres that slip by v in a turn at w give 2 v w.
  double slip = 0.0;
  for (const BodyContact& wheel : step.response.wheels) slip = std::max(slip, wheel.slip.norm());
  const double turn = step.reading.state.q.size() > 0 && !step.response.wheels.empty()
                          ? std::abs(wheels_.CalcTurn(step.reading.state.xi))
                          : 0.0;
  const double g = setup_->model().gravity().norm();
  // Traction acts in the middle of how far a tyre has sunk, and not at the whole radius: f_t / r times half
  // of that, with the robot's weight on a floor of mu <= 1.
  double sunk = 0.0;
  for (const BodyContact& wheel : step.response.wheels)
    sunk += std::max(0.0, -0.5 * wheel.distance) * wheel.cone_use;
  if (sunk > 0.0) {
    sunk *=
        mass_ * g / setup_->model().base().wheel_radius / std::sqrt(setup_->model().base_with_wheels().mass);
  }
  return (g * step.reading.departure.tilt + 2.0 * slip * turn) * std::sqrt(mass_) + sunk;
}

void StepChecks::AddLess(StepCheck which, double residual, double known, double time) {
  const double most = std::min(residual, check(which).bound);
  Add(which, std::isnan(residual) ? residual : std::max(most, residual - known), time);
}

double StepChecks::Weight() const { return setup_->object().body.mass * setup_->model().gravity().norm(); }

void StepChecks::CompareObject(const StepRecord& step) {
  if (!setup_->has_object()) return Add(StepCheck::kSolver, solver_of_robot_);
  // (19), as forces at the contacts' arm
  const GraspTerms& grasp = ModelAtTrueState(step).grasp();
  const PlantResponse& response = step.response;
  const ObjectBodyTerms& body = grasp.body();
  // Of an object that is not held, its radius of gyration.
  const double arm = grasp.num_contacts() > 0
                         ? grasp.contacts()[0].geometry.g_o_cf.translation().norm()
                         : std::sqrt(body.M_hat.bottomRightCorner<3, 3>().trace() / body.M_hat(0, 0));
  const Vector6d push = step.known != nullptr ? step.known->object_wrench : Vector6d(Vector6d::Zero());
  const auto relative = [&](const Vector6d& wrench) {
    return std::max(wrench.head<3>().norm(), wrench.tail<3>().norm() / arm) /
           std::max(Weight(), findings_.f_c.norm());
  };
  left_of_object_ = body.M_hat * response.V_Bo_dot + body.C_hat * grasp.V_Bo() + body.N_o -
                    grasp.G() * findings_.f_c - response.support_wrench - response.solver_residual - push;
  Add(StepCheck::kInverseDynamicsObject, relative(left_of_object_));
  // What the solver leaves over while contacts come and go is taken off the balances, and is gone some steps
  // later.
  if (is_excluded_) return;
  Add(StepCheck::kSolver, std::max(relative(response.solver_residual), solver_of_robot_));
}

void StepChecks::KeepForces(const StepRecord& step) {
  const auto fails = [&](StepCheck which) {
    return check(which).applies && !(check(which).last <= check(which).bound);
  };
  if (mass_factor() == nullptr) return;
  if (!fails(StepCheck::kInverseDynamicsRobot) && !fails(StepCheck::kInverseDynamicsObject)) return;
  forces_.Add(left_of_robot_, left_of_object_, ModelAtTrueState(step), step.reading.state.q, *mass_factor(),
              scale_);
}

void StepChecks::CompareRolling(const StepRecord& step) {
  const VectorXd& xi = step.reading.state.xi;
  const Vector2d rates = ReadWheelRates(step);
  const Vector2d mismatch = wheels_.CalcMismatch(xi, rates);
  double beyond = 0.0;
  for (size_t k = 0; k < 2; ++k) {
    // A tyre that gives rolls on a radius that is smaller by as much.
    const BodyContact& wheel = step.response.wheels[k];
    const double sunk = std::max(0.0, -wheel.distance) * std::abs(rates[static_cast<Eigen::Index>(k)]);
    beyond = std::max(beyond, std::abs(mismatch[static_cast<Eigen::Index>(k)]) - wheel.slip.norm() - sunk);
  }
  // So does one whose platform sinks or tilts while the tyres give to a force that changes.
  beyond = std::max(0.0, beyond - compliance_->sinking());
  Add(StepCheck::kRolling, beyond);
  if (!(beyond <= check(StepCheck::kRolling).bound)) wheels_.Add(xi, rates);
}

void StepChecks::CheckJointLimits(const MeasuredState& state) {
  const std::vector<Joint>& joints = setup_->model().joints();
  const int offset = setup_->model().num_base_positions();
  double beyond = 0.0;
  size_t farthest = 0;
  for (size_t i = 0; i < joints.size(); ++i) {
    const double q = state.q[offset + static_cast<int>(i)];
    const double over = std::max(q - joints[i].upper, joints[i].lower - q);
    if (over <= beyond) continue;
    beyond = over;
    farthest = i;
  }
  if (beyond > check(StepCheck::kJointLimit).bound && !check(StepCheck::kJointLimit).failed) {
    check(StepCheck::kJointLimit).part = "joint " + Quote(joints[farthest].name);
  }
  Add(StepCheck::kJointLimit, beyond);
}

}  // namespace dexcheck
