#include "harness/checks/step_checks.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "controller/common/text.h"
#include "controller/contact/rolling.h"
#include "harness/plant/body_contact.h"

namespace dexcheck {
namespace {

/// Integrated and measured contact farther apart than this have nothing to do with each other any more, and
/// one may lie at the pole of the other's chart, m. Less than from a chart's margin to its pole, 4 mm on a
/// fingertip of 9 mm.
constexpr double kStray = 1e-3;

/// Writes the integrated contact in the charts of the measured one, which kappa_dot is in.
void FollowCharts(const Surface& tip, const Surface& object, const ContactCoordinates& measured,
                  ContactCoordinates* integrated) {
  const int tip_chart = measured.alpha_f.chart;
  const int object_chart = measured.alpha_o.chart;
  if (integrated->alpha_f.chart == tip_chart && integrated->alpha_o.chart == object_chart) return;
  const auto is_near = [](const Surface& surface, const SurfacePoint& a, const SurfacePoint& b) {
    return (surface.Evaluate(a).p - surface.Evaluate(b).p).norm() < kStray;
  };
  if (!is_near(tip, integrated->alpha_f, measured.alpha_f)) return;
  if (!is_near(object, integrated->alpha_o, measured.alpha_o)) return;
  *integrated = ChangeCharts(tip, object, *integrated, tip_chart, object_chart);
}

}  // namespace

StepChecks::PartialDynamics::PartialDynamics(const Setup& setup, ContactSet set)
    : grasp(setup.model(), setup.fingertips(), setup.object().body, setup.surface(), set),
      dynamics(setup.model(), static_cast<int>(grasp.members().size())) {}

StepChecks::StepChecks(const Setup& setup)
    : setup_(&setup),
      checks_(kCheckCount),
      dynamics_(setup.model(), static_cast<int>(setup.fingertips().size())),
      actuation_(setup.model()) {
  const RobotModel& model = setup.model();
  const mjModel& engine = setup.engine();
  using enum CheckKind;
  Define(
      kBalanceRobot, "balance_robot", kBalance, "1", 1e-5,
      "what is left of (48) with the engine's accelerations and contact forces, against the forces balanced");
  Define(kBalanceObject, "balance_object", kBalance, "1", 1e-9,
         "what is left of (19) with the engine's acceleration and contact forces, less what its solver left "
         "over, against the contact forces");
  Define(kReducedAcceleration, "reduced_acceleration", kPrediction, "1", 1e-5,
         "xi_dot of the rigid constrained system (46), (48) against the engine's");
  Define(kContactForce, "contact_force", kPrediction, "1", 1e-6,
         "f_c of the rigid constrained system against the engine's, relative to |f_c|");
  Define(kFingertipSlip, "fingertip_slip", kAssumption, "m", 2e-4,
         "how far a fingertip has slipped on the object in the last 5 to 10 s");
  const double dt = setup.scenario().plant.time_step;
  constexpr PlantOptions kShipped;
  Define(kFingertipSlipRate, "fingertip_slip_rate", kAssumption, "m/s",
         (1.0 - kShipped.contact_impedance) * dt / kShipped.impratio * kTipLoad,
         "how fast a fingertip slips on the object, less what (46) and the engine's constraint differ by");
  Define(kWheelSlip, "wheel_slip", kAssumption, "m", 1e-3,
         "how far a wheel has slipped on the floor in the last 5 to 10 s, (1)");
  Define(kWheelSlipRate, "wheel_slip_rate", kAssumption, "m/s", dt * kSideways,
         "how fast a wheel slips on the floor");
  Define(kConeUse, "cone_use", kAssumption, "1", 0.99,
         "tangential force over mu times normal force at a fingertip; 1 slides, (21)");
  Define(kTractionUse, "traction_use", kAssumption, "1", 0.99,
         "tangential force over mu times normal force at a wheel; 1 spins or skids");
  Define(kContactsLost, "contacts_lost", kAssumption, "1", 0.0, "fingertips that do not touch the object");
  Define(kPenetration, "penetration", kAssumption, "m", 2e-5, "overlap of fingertip and object");
  Define(
      kKappa, "kappa", kAssumption, "m", 2e-4,
      "contact point on the object: kappa integrated by (40) over the last 5 to 10 s against the engine's");
  Define(kBaseTilt, "base_tilt", kAssumption, "rad", 1e-5, "angle of the platform against the vertical");
  Define(kIdleJoints, "idle_joints", kAssumption, "rad", 1e-5,
         "movement since t = 0 of joints that do not carry the object");
  // As small as the discrepancies that balance_robot and the prediction are judged by.
  Define(kSolver, "solver", kAssumption, "1", 1e-5,
         "what the engine's solver left over of its own equation of motion of the object, as balance_object");
  Define(kJointStop, "joint_stop", kAssumption, "rad", 0.0,
         "how far a joint is beyond its range, where a stop pushes that the model does not have");
  // The fingers of one hand touch within some hundredths of a second, kTransient each at the most.
  Define(kUnjudged, "unjudged", kAssumption, "s", 5.0 * kTransient,
         "how long in one go contacts have come and gone, so that balance and prediction were not judged");
  Define(kActuators, "actuator_effort", kAssumption, "1", 1.0, "|tau'| over the motor's limit");
  SetApplying();
  for (const auto& [name, bound] : setup.scenario().bounds) {
    const auto found = std::find_if(checks_.begin(), checks_.end(),
                                    [&, &key = name](const RunCheck& check) { return check.name == key; });
    if (found == checks_.end()) {
      throw InputError(setup.scenario().source + ": bounds." + name + ": no check has this name");
    }
    found->bound = bound;
  }

  fingertip_slip_.resize(setup.fingertips().size());
  wheel_slip_.resize(setup.adapter().wheels().size());
  for (const int tip : setup.fingertips()) {
    tip_bodies_.push_back(engine.site_bodyid[setup.adapter().frame_sites()[static_cast<size_t>(tip)]]);
  }
  for (const EngineWheel& wheel : setup.adapter().wheels()) {
    wheel_bodies_.push_back(engine.jnt_bodyid[wheel.joint]);
  }
  const int n = model.num_velocities();
  engine_.xi_dot.setZero(n);
  engine_.f_c.setZero(3 * static_cast<Eigen::Index>(setup.fingertips().size()));
  force_.setZero(n);
  bias_.setZero(n);
  residual_.setZero(n);
  column_.setZero(n, 1);
  part_prediction_.xi_dot.setZero(n);
  part_prediction_.f_c = engine_.f_c;
  prediction_ = &part_prediction_;
  idle_start_.setZero(static_cast<Eigen::Index>(setup.idle_joints().size()));
  kappa_.resize(setup.fingertips().size());
  next_kappa_ = kappa_;
}

void StepChecks::SetApplying() {
  const auto leave_out = [&](bool leave, std::initializer_list<Check> checks) {
    for (const Check check : checks) checks_[check].applies = checks_[check].applies && !leave;
  };
  const mjModel& engine = setup_->engine();
  // A bond neither slides nor rolls, nor does it care for friction.
  const bool bonded = !setup_->bonds().empty();
  if (bonded) checks_[kFingertipSlip].description = "distance of the joined points on fingertip and object";
  leave_out(bonded, {kFingertipSlipRate, kConeUse, kContactsLost, kPenetration, kKappa});
  // Without a task every step is judged.
  leave_out(!setup_->scenario().task, {kUnjudged});
  leave_out(setup_->adapter().wheels().empty(), {kWheelSlip, kWheelSlipRate, kTractionUse});
  leave_out(setup_->model().base().type == BaseType::kFixed, {kBaseTilt});
  leave_out(setup_->idle_joints().empty(), {kIdleJoints});
  const mjtByte* const limited = engine.actuator_ctrllimited;
  leave_out(std::none_of(limited, limited + engine.nu, [](mjtByte flag) { return flag != 0; }), {kActuators});
}

void StepChecks::Define(Check check, const char* name, CheckKind kind, const char* unit, double bound,
                        const char* description) {
  RunCheck& c = checks_[check];
  c.name = name;
  c.kind = kind;
  c.unit = unit;
  c.bound = bound;
  c.description = description;
}

void StepChecks::Reset() {
  for (RunCheck& check : checks_) check.Reset();
  std::fill(fingertip_slip_.begin(), fingertip_slip_.end(), SlipState{});
  std::fill(wheel_slip_.begin(), wheel_slip_.end(), SlipState{});
  contacts_lost_ = 0;
  least_cone_margin_ = std::numeric_limits<double>::infinity();
  steps_ = 0;
  has_kappa_ = false;
  transient_steps_ = 0;
  is_unjudged_ = false;
  changed_at_ = -std::numeric_limits<double>::infinity();
}

const RunCheck& StepChecks::Find(std::string_view name) const {
  for (const RunCheck& check : checks_) {
    if (check.name == name) return check;
  }
  throw std::invalid_argument("no check " + Quote(name));
}

void StepChecks::Compare(const Plant& plant, const GraspController& controller, const MeasuredState& state,
                         const Eigen::Ref<const VectorXd>& tau, Observer* observer, double time,
                         const Handling& handling) {
  time_ = time;
  observer->ReadAccelerations(plant, state, engine_.xi_dot, &engine_.V_Bo_dot);
  contacts_ = observer->ReadContacts(plant);
  int lost = 0;
  double penetration = 0.0;
  for (size_t i = 0; i < contacts_.size(); ++i) {
    const Matrix3d R_B_cf = state.X_Bo.linear() * controller.grasp().contacts()[i].geometry.g_o_cf.linear();
    engine_.f_c.segment<3>(3 * static_cast<Eigen::Index>(i)) = R_B_cf.transpose() * contacts_[i].force;
    if (!contacts_[i].touching) ++lost;
    if (handling.holding && !contacts_[i].touching && fingertip_slip_[i].touching) ++contacts_lost_;
    penetration = std::max(penetration, -contacts_[i].distance);
  }
  Add(kContactsLost, handling.holding ? lost : 0);
  Add(kPenetration, penetration);
  support_ = observer->ReadSupportWrench(plant, state.X_Bo);
  solver_residual_ = observer->ReadSolverResidual(plant, state.X_Bo);
  support_force_ = (state.X_Bo.linear() * support_.head<3>()).z();
  FindContacts(handling);
  const bool unjudged = handling.partial && time - changed_at_ < kTransient;
  if (unjudged && !is_unjudged_) unjudged_since_ = time;
  is_unjudged_ = unjudged;
  Add(kUnjudged, unjudged ? time - unjudged_since_ : 0.0);
  if (unjudged) {
    ++transient_steps_;
  } else {
    CompareDynamics(controller, state, tau);
    CompareObject(controller);
  }
  if (handling.holding && !was_holding_) ForgetSlip();
  was_holding_ = handling.holding;
  MoveWindows(state, plant.time_step());
  ReadSlip(plant, controller.grasp(), state);
  if (handling.holding) CompareKappa(controller, state, plant.time_step());

  Add(kBaseTilt, observer->departure().tilt);
  double idle = 0.0;
  const std::vector<int>& joints = setup_->idle_joints();
  const int offset = setup_->model().num_base_positions();
  for (size_t i = 0; i < joints.size(); ++i) {
    const double q = state.q[offset + joints[i]];
    double& start = idle_start_[static_cast<Eigen::Index>(i)];
    if (steps_ == 0) start = q;
    idle = std::max(idle, std::abs(q - start));
  }
  Add(kIdleJoints, idle);
  CheckJointStops(state);
  ++steps_;
}

void StepChecks::FindContacts(const Handling& handling) {
  if (handling.contacts != handling_.contacts) changed_at_ = time_;
  handling_ = handling;
  ContactSet touching = 0;
  for (size_t i = 0; i < contacts_.size(); ++i) {
    if (contacts_[i].touching) touching |= ContactSet{1} << i;
  }
  const bool supported = !support_.isZero(0.0);
  if (touching != touching_ || supported != supported_) changed_at_ = time_;
  touching_ = touching;
  supported_ = supported;
}

void StepChecks::ForgetSlip() {
  std::fill(fingertip_slip_.begin(), fingertip_slip_.end(), SlipState{});
  has_kappa_ = false;
}

void StepChecks::Predict(const GraspController& controller, const MeasuredState& state) {
  const bool whole = touching_ == AllContacts(static_cast<int>(contacts_.size()));
  mass_factor_ = &dynamics_.mass_factor();
  if (!handling_.partial || (whole && !supported_)) {
    prediction_ = &dynamics_.Predict(controller.robot(), controller.grasp(), force_);
  } else if (whole) {
    prediction_ = &dynamics_.Predict(controller.robot(), controller.grasp(), force_, ObjectSupport::kAtRest);
  } else if (touching_ == 0) {
    prediction_ = &dynamics_.PredictFree(controller.robot(), force_);
  } else {
    PredictPart(controller, state);
  }
}

void StepChecks::PredictPart(const GraspController& controller, const MeasuredState& state) {
  std::unique_ptr<PartialDynamics>& part = parts_[touching_];
  if (!part) part = std::make_unique<PartialDynamics>(*setup_, touching_);
  part->grasp.SetState(controller.robot(), state);
  const Prediction& prediction =
      part->dynamics.Predict(controller.robot(), part->grasp.terms(), force_,
                             supported_ ? ObjectSupport::kAtRest : ObjectSupport::kHand);
  part_prediction_.xi_dot = prediction.xi_dot;
  part_prediction_.V_Bo_dot = prediction.V_Bo_dot;
  part->grasp.Scatter(prediction.f_c, part_prediction_.f_c);
  prediction_ = &part_prediction_;
  mass_factor_ = &part->dynamics.mass_factor();
}

void StepChecks::CompareDynamics(const GraspController& controller, const MeasuredState& state,
                                 const Eigen::Ref<const VectorXd>& tau) {
  const ModelTerms& robot = controller.robot();
  const GraspTerms& grasp = controller.grasp();
  actuation_.CalcForce(tau, force_);
  Predict(controller, state);

  // (48): M_bar' xi_dot + C_bar' xi + F_bar' + J_B'^T f_c - E_bar' tau'
  bias_ = robot.gravity() + robot.friction();
  bias_.noalias() += robot.C() * state.xi;
  residual_ = bias_ - force_;
  residual_.noalias() += robot.M() * engine_.xi_dot;
  residual_.noalias() += grasp.J_B().transpose() * engine_.f_c;
  // |f|_M^-1 = |L^-T f|
  const auto norm = [&](const VectorXd& f) {
    column_ = f;
    mass_factor_->SolveTransposed(column_);
    return column_.norm();
  };
  const double scale = std::max(norm(bias_), std::numeric_limits<double>::min());
  Add(kBalanceRobot, norm(residual_) / scale);

  // |a|_M = |L a|
  residual_ = prediction_->xi_dot - engine_.xi_dot;
  mass_factor_->Multiply(residual_);
  Add(kReducedAcceleration, residual_.norm() / scale);
  double force_scale = std::max(engine_.f_c.norm(), std::numeric_limits<double>::min());
  // Fingertips that only touch push with less than what they will bear.
  if (handling_.partial) force_scale = std::max(force_scale, Weight());
  Add(kContactForce, (prediction_->f_c - engine_.f_c).norm() / force_scale);
}

double StepChecks::Weight() const { return setup_->object().body.mass * setup_->model().gravity().norm(); }

void StepChecks::CompareObject(const GraspController& controller) {
  // (19), as forces at the contacts' arm
  const GraspTerms& grasp = controller.grasp();
  const ObjectBodyTerms& body = grasp.body();
  const double arm = grasp.contacts()[0].geometry.g_o_cf.translation().norm();
  const auto relative = [&](const Vector6d& wrench) {
    return std::max(wrench.head<3>().norm(), wrench.tail<3>().norm() / arm) /
           std::max(Weight(), engine_.f_c.norm());
  };
  Add(kBalanceObject, relative(body.M_hat * engine_.V_Bo_dot + body.C_hat * grasp.V_Bo() + body.N_o -
                               grasp.G() * engine_.f_c - support_ - solver_residual_));
  Add(kSolver, relative(solver_residual_));
}

void StepChecks::MoveWindows(const MeasuredState& state, double dt) {
  const long half = std::max(1L, std::lround(0.5 * kWindow / dt));
  if (steps_ == 0 || steps_ % half != 0) return;
  for (std::vector<SlipState>* slips : {&fingertip_slip_, &wheel_slip_}) {
    for (SlipState& slip : *slips) {
      slip.window = slip.next_window;
      slip.next_window = slip.distance;
    }
  }
  if (!has_kappa_) return;
  kappa_ = next_kappa_;
  next_kappa_ = state.kappa;
}

void StepChecks::ReadSlip(const Plant& plant, const GraspTerms& grasp, const MeasuredState& state) {
  const double dt = plant.time_step();
  double slipped = 0.0;
  double rate = 0.0;
  double cone_use = 0.0;
  const auto update = [&](SlipState* slip, const BodyContact& contact, const Matrix3d& R) {
    slip->touching = contact.touching;
    slip->cone_use = contact.cone_use;
    slip->cone_margin = contact.cone_margin;
    slip->velocity = R.transpose() * contact.slip;
    slip->distance += dt * slip->velocity;
    slipped = std::max(slipped, (slip->distance - slip->window).norm());
    cone_use = std::max(cone_use, contact.cone_use);
  };
  const int object = setup_->adapter().object_body();
  for (size_t i = 0; i < tip_bodies_.size(); ++i) {
    update(&fingertip_slip_[i], ReadBodyContact(plant.model(), plant.data(), tip_bodies_[i], object),
           state.X_Bo.linear());
    const Vector2d unasked = grasp.slip_bias().segment<2>(3 * static_cast<Eigen::Index>(i));
    rate = std::max(rate, fingertip_slip_[i].velocity.norm() - dt * unasked.norm());
    if (fingertip_slip_[i].touching && handling_.holding) {
      least_cone_margin_ = std::min(least_cone_margin_, fingertip_slip_[i].cone_margin);
    }
  }
  if (!setup_->bonds().empty()) {
    for (const EngineContact& bond : contacts_) slipped = std::max(slipped, bond.distance);
  }
  if (handling_.holding) {
    Add(kFingertipSlip, slipped);
    if (!is_unjudged_) Add(kFingertipSlipRate, rate);
    Add(kConeUse, cone_use);
  }
  slipped = 0.0;
  rate = 0.0;
  cone_use = 0.0;
  const double phi = setup_->model().num_base_positions() == 3 ? state.q[2] : 0.0;
  const Matrix3d R_B0 = Eigen::AngleAxisd(phi, Vector3d::UnitZ()).toRotationMatrix();
  for (size_t i = 0; i < wheel_bodies_.size(); ++i) {
    update(&wheel_slip_[i], ReadBodyContact(plant.model(), plant.data(), wheel_bodies_[i], 0), R_B0);
    rate = std::max(rate, wheel_slip_[i].velocity.norm());
  }
  Add(kWheelSlip, slipped);
  Add(kWheelSlipRate, rate);
  Add(kTractionUse, cone_use);
}

void StepChecks::CheckJointStops(const MeasuredState& state) {
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
  if (beyond > 0.0 && !checks_[kJointStop].failed) {
    checks_[kJointStop].where = "joint " + Quote(joints[farthest].name);
  }
  Add(kJointStop, beyond);
}

void StepChecks::CompareKappa(const GraspController& controller, const MeasuredState& state, double dt) {
  const GraspTerms& grasp = controller.grasp();
  double apart = 0.0;
  for (size_t i = 0; i < kappa_.size(); ++i) {
    if (!has_kappa_) {
      kappa_[i] = next_kappa_[i] = state.kappa[i];
      continue;
    }
    // The velocity at hand led from the last state to this one.
    const Vector5d change = dt * grasp.contacts()[i].kappa_dot;
    const Surface& tip = grasp.tip(static_cast<int>(i));
    for (std::vector<ContactCoordinates>* integrated : {&kappa_, &next_kappa_}) {
      ContactCoordinates& kappa = (*integrated)[i];
      FollowCharts(tip, grasp.surface(), state.kappa[i], &kappa);
      kappa = NormalizeContact(tip, grasp.surface(), Displace(kappa, change));
    }
    const Vector3d integrated = grasp.surface().Evaluate(kappa_[i].alpha_o).p;
    const Vector3d measured = grasp.surface().Evaluate(state.kappa[i].alpha_o).p;
    apart = std::max(apart, (integrated - measured).norm());
  }
  has_kappa_ = true;
  Add(kKappa, apart);
}

}  // namespace dexcheck
