#include "harness/plant/rigid_plant.h"

#include <cmath>

#include "controller/common/text.h"
#include "controller/contact/shapes.h"
#include "controller/model/platform.h"
#include "controller/object/so3.h"
#include "harness/engine/map_vector.h"
#include "harness/plant/disturbances.h"
#include "harness/plant/plant.h"

namespace dexcheck {
namespace {

/// Rate w of Runge-Kutta's method, 1/s. The stages of a step are off the constraints by h^2 and more, so a
/// rate that grew as the step shrinks would cost two orders.
constexpr double kStabilisationRate = 20.0;

std::unique_ptr<Surface> MakeHeldSurface(const RobotModel& model, bool holds) {
  // An object that is not held needs a surface only to have one.
  return holds ? MakeSurface(model.object()->shape) : std::make_unique<Sphere>(1.0);
}

MassProperties FindHeldBody(const RobotModel& model, bool holds) {
  return holds ? model.object()->body : MassProperties{1.0, Vector3d::Zero(), Matrix3d::Identity()};
}

}  // namespace

RigidPlant::RigidPlant(const RobotModel& model, const Adapter& adapter, std::span<const int> fingertips,
                       std::span<const Motor> motors, const RigidPlantOptions& options)
    : model_(&model),
      adapter_(&adapter),
      holds_(!fingertips.empty()),
      surface_(MakeHeldSurface(model, holds_)),
      motors_(motors.begin(), motors.end()),
      options_(options),
      robot_(model, Coordinates::kReduced),
      grasp_(model, fingertips, FindHeldBody(model, holds_), *surface_),
      dynamics_(model, static_cast<int>(fingertips.size())),
      actuation_(model),
      velocity_map_(adapter, Coordinates::kReduced) {
  const int p = model.num_positions();
  const int n = model.num_velocities();
  const size_t count = fingertips.size();
  for (State* state : {&state_, &stage_}) {
    state->q.setZero(p);
    state->xi.setZero(n);
    state->kappa.resize(count);
  }
  for (Rate* rate : {&k1_, &k2_, &k3_, &k4_}) {
    rate->q_dot.setZero(p);
    rate->xi_dot.setZero(n);
    rate->kappa_dot.setZero(5 * static_cast<Eigen::Index>(count));
    rate->f_c.setZero(grasp_.num_forces());
  }
  gaps_.assign(count, 0.0);
  gaps_before_ = gaps_;
  overlaps_ = gaps_;
  g_o_cf_before_.assign(count, Pose::Identity());
  force_.setZero(n);
  tau_.setZero(n);
  stabilisation_.setZero(grasp_.num_forces());
  f_c_before_.setZero(grasp_.num_forces());
  slip_before_.setZero(grasp_.num_forces());
}

void RigidPlant::BeginStep() { FindContacts(); }

void RigidPlant::FindContacts() {
  robot_.SetState(state_.q, state_.xi);
  const Pose X_oB = state_.X_Bo.inverse();
  for (size_t i = 0; i < gaps_.size(); ++i) {
    const Pose X_of = X_oB * robot_.CalcFramePose(grasp_.fingertips()[i]);
    const Surface& tip = grasp_.tip(static_cast<int>(i));
    const FoundContact found = has_contacts_ ? FindContact(tip, *surface_, X_of, state_.kappa[i])
                                             : FindContact(tip, *surface_, X_of);
    state_.kappa[i] = found.kappa;
    gaps_[i] = found.gap;
    overlaps_[i] = -found.gap;
  }
  grasp_.SetOverlaps(overlaps_);
  has_contacts_ = true;
}

void RigidPlant::Read(PlantReading* reading) {
  MeasuredState& state = reading->state;
  state.q = state_.q;
  state.xi = state_.xi;
  state.X_Bo = state_.X_Bo;
  state.V_Bo = state_.V_Bo;
  state.kappa = state_.kappa;
  state.overlap = overlaps_;
  reading->touch.fingertips = AllContacts(static_cast<int>(gaps_.size()));
  reading->touch.support_force = 0.0;
  reading->departure = BaseDeparture{};
  reading->X_W0 = robot_.CalcLinkPose(-1);

  const mjModel& m = adapter_->engine();
  reading->qpos = Eigen::Map<const VectorXd>(m.qpos0, m.nq);
  adapter_->SetPositions(state_.q, reading->qpos.data());
  reading->qvel.setZero(m.nv);
  velocity_map_.SetState(state_.q, state_.xi);
  velocity_map_.Expand(state_.xi, reading->qvel.data());
  if (!holds_) return;
  WriteFreePose(state_.X_Bo, reading->qpos.data() + adapter_->object_qpos());
  reading->qvel.segment<6>(adapter_->object_dof()) << state_.X_Bo.linear() * state_.V_Bo.head<3>(),
      state_.V_Bo.tail<3>();
}

void RigidPlant::EndStep(const Eigen::Ref<const VectorXd>& tau) {
  tau_ = tau;
  actuation_.CalcForce(tau, force_);
  if (options_.integrator == Integrator::kRungeKutta4) {
    StepRungeKutta();
  } else {
    StepEuler();
  }
  time_ += options_.time_step;
  // Products of rotations leave the group by rounding.
  state_.X_Bo.linear() = Eigen::Quaterniond(state_.X_Bo.linear()).normalized().toRotationMatrix();
  for (size_t i = 0; i < state_.kappa.size(); ++i) {
    state_.kappa[i] = NormalizeContact(grasp_.tip(static_cast<int>(i)), *surface_, state_.kappa[i]);
  }
  RequireFinite();
}

void RigidPlant::RequireFinite() const {
  if (state_.q.allFinite() && state_.xi.allFinite() && state_.X_Bo.matrix().allFinite() &&
      state_.V_Bo.allFinite())
    return;
  throw DivergenceError(
      "the rigid plant's state is not finite after t = " + FormatNumber(time_ - options_.time_step) + " s");
}

void RigidPlant::CalcCoordinateRates(const Eigen::Ref<const VectorXd>& q,
                                     const Eigen::Ref<const VectorXd>& xi, VectorXd* q_dot) const {
  // q_dot' = S' xi
  const Eigen::Index joints = model_->num_joints();
  q_dot->tail(joints) = xi.tail(joints);
  if (model_->base().type == BaseType::kDifferentialDrive) {
    q_dot->head<3>() = CalcPlatformConstraint(model_->base(), q.head<3>(), xi.head<2>()).S_v * xi.head<2>();
  } else {
    q_dot->head(q.size() - joints) = xi.head(xi.size() - joints);
  }
}

void RigidPlant::Evaluate(const State& state, const Vector3d& turn, Rate* rate) {
  robot_.SetState(state.q, state.xi);
  robot_.CalcDynamics();
  if (!holds_) return EvaluateFree(state, rate);
  grasp_.SetPose(robot_, state.X_Bo, state.V_Bo, state.kappa);
  // d/dt r = -2 w r + [0; 0; w^2 g]
  const double h = options_.time_step;
  const bool euler = options_.integrator == Integrator::kSemiImplicitEuler;
  const double w = euler ? 0.5 / h : kStabilisationRate;
  stabilisation_ = -2.0 * w * grasp_.slip();
  // Velocities of half a step before satisfy (45) there: r(t - h/2) = r - h/2 dr/dt.
  if (euler) stabilisation_ += w * h * grasp_.slip_bias();
  for (size_t i = 0; i < gaps_.size(); ++i) {
    stabilisation_[3 * static_cast<Eigen::Index>(i) + 2] += w * w * gaps_[i];
  }
  pushed_ = force_;
  AddRobotForce(wrenches_, robot_, pushed_);
  const Vector6d on_object = CalcObjectWrench(wrenches_, state.X_Bo);
  const Prediction& motion =
      dynamics_.Predict(robot_, grasp_, pushed_, ObjectSupport::kHand, &stabilisation_, &on_object);
  CalcCoordinateRates(state.q, state.xi, &rate->q_dot);
  rate->xi_dot = motion.xi_dot;
  rate->V_Bo_dot = motion.V_Bo_dot;
  rate->f_c = motion.f_c;
  rate->p_dot = state.X_Bo.linear() * state.V_Bo.head<3>();
  // omega = J_r(turn) turn_dot, J_r(turn) = J_l(-turn)
  rate->turn_dot = CalcLeftJacobianInverse(-turn) * state.V_Bo.tail<3>();
  for (size_t i = 0; i < gaps_.size(); ++i) {
    rate->kappa_dot.segment<5>(5 * static_cast<Eigen::Index>(i)) = grasp_.contacts()[i].kappa_dot;
  }
}

void RigidPlant::EvaluateFree(const State& state, Rate* rate) {
  pushed_ = force_;
  AddRobotForce(wrenches_, robot_, pushed_);
  CalcCoordinateRates(state.q, state.xi, &rate->q_dot);
  rate->xi_dot = dynamics_.PredictFree(robot_, pushed_).xi_dot;
}

void RigidPlant::KeepResponse() {
  if (!holds_) return;
  X_Bo_before_ = state_.X_Bo;
  for (size_t i = 0; i < gaps_.size(); ++i) {
    g_o_cf_before_[i] = grasp_.contacts()[i].geometry.g_o_cf;
  }
  f_c_before_ = k1_.f_c;
  gaps_before_ = gaps_;
  slip_before_ = grasp_.slip();
}

Vector3d RigidPlant::Displace(const State& start, const Rate& rate, double dt, State* state) const {
  const Vector3d turn = dt * rate.turn_dot;
  state->q = start.q + dt * rate.q_dot;
  state->xi = start.xi + dt * rate.xi_dot;
  state->X_Bo.translation() = start.X_Bo.translation() + dt * rate.p_dot;
  state->X_Bo.linear() = start.X_Bo.linear() * ExpSo3(turn);
  state->V_Bo = start.V_Bo + dt * rate.V_Bo_dot;
  for (size_t i = 0; i < start.kappa.size(); ++i) {
    const Vector5d change = dt * rate.kappa_dot.segment<5>(5 * static_cast<Eigen::Index>(i));
    state->kappa[i] = dexcheck::Displace(start.kappa[i], change);
  }
  return turn;
}

void RigidPlant::StepRungeKutta() {
  const double h = options_.time_step;
  Evaluate(state_, Vector3d::Zero(), &k1_);
  KeepResponse();
  Vector3d turn = Displace(state_, k1_, 0.5 * h, &stage_);
  Evaluate(stage_, turn, &k2_);
  turn = Displace(state_, k2_, 0.5 * h, &stage_);
  Evaluate(stage_, turn, &k3_);
  turn = Displace(state_, k3_, h, &stage_);
  Evaluate(stage_, turn, &k4_);
  // k2 becomes the mean.
  const auto average = [this](auto Rate::*part) {
    k2_.*part = (k1_.*part + 2.0 * k2_.*part + 2.0 * k3_.*part + k4_.*part) / 6.0;
  };
  for (VectorXd Rate::*part : {&Rate::q_dot, &Rate::xi_dot, &Rate::kappa_dot}) average(part);
  for (Vector3d Rate::*part : {&Rate::p_dot, &Rate::turn_dot}) average(part);
  average(&Rate::V_Bo_dot);
  Displace(state_, k2_, h, &stage_);
  std::swap(state_, stage_);
}

void RigidPlant::StepEuler() {
  const double h = options_.time_step;
  Evaluate(state_, Vector3d::Zero(), &k1_);
  KeepResponse();
  // p_ddot = R (v_dot + omega x v)
  const Matrix3d R = state_.X_Bo.linear();
  const Vector3d v = state_.V_Bo.head<3>();
  const Vector3d omega = state_.V_Bo.tail<3>();
  const Vector3d p_dot = R * (v + h * (k1_.V_Bo_dot.head<3>() + omega.cross(v)));
  const Vector3d new_omega = omega + h * k1_.V_Bo_dot.tail<3>();
  state_.xi += h * k1_.xi_dot;
  CalcCoordinateRates(state_.q, state_.xi, &k1_.q_dot);
  state_.q += h * k1_.q_dot;
  state_.X_Bo.translation() += h * p_dot;
  state_.X_Bo.linear() = R * ExpSo3(h * new_omega);
  state_.V_Bo << state_.X_Bo.linear().transpose() * p_dot, new_omega;
  for (size_t i = 0; i < state_.kappa.size(); ++i) {
    const Vector5d change = h * k1_.kappa_dot.segment<5>(5 * static_cast<Eigen::Index>(i));
    state_.kappa[i] = dexcheck::Displace(state_.kappa[i], change);
  }
}

void RigidPlant::Read(PlantResponse* response) {
  response->xi_dot = k1_.xi_dot;
  response->V_Bo_dot = k1_.V_Bo_dot;
  response->contacts.resize(gaps_.size());
  response->fingertips.resize(gaps_.size());
  const double mu = options_.finger_friction;
  for (size_t i = 0; i < gaps_.size(); ++i) {
    const Pose X_B_cf = X_Bo_before_ * g_o_cf_before_[i];
    const Vector3d f = f_c_before_.segment<3>(3 * static_cast<Eigen::Index>(i));
    const Vector2d slip = slip_before_.segment<2>(3 * static_cast<Eigen::Index>(i));
    const double tangential = f.head<2>().norm();
    PlantContact& contact = response->contacts[i];
    // A rigid contact that would have to pull is one that a hand does not have.
    contact.touching = f.z() > 0.0;
    contact.position = X_B_cf.translation();
    contact.normal = X_B_cf.linear().col(2);
    contact.distance = gaps_before_[i];
    contact.force = X_B_cf.linear() * f;
    BodyContact& tip = response->fingertips[i];
    tip.touching = contact.touching;
    tip.distance = contact.distance;
    tip.slip = X_B_cf.linear().leftCols<2>() * slip;
    tip.cone_use = contact.touching ? tangential / (mu * f.z()) : 0.0;
    tip.cone_margin = mu * f.z() - tangential;
  }
  // The wheels roll.
  BodyContact rolling;
  rolling.touching = true;
  response->wheels.assign(adapter_->wheels().size(), rolling);
  response->support_wrench.setZero();
  response->support_force = 0.0;
  response->motor_torques = tau_;
}

void RigidPlant::Place(const Eigen::Ref<const VectorXd>& q, const Pose& X_Bo) {
  state_.q = q;
  state_.xi.setZero();
  state_.X_Bo = X_Bo;
  state_.V_Bo.setZero();
  has_contacts_ = false;
}

void RigidPlant::AddVelocity(const MeasuredState& /*state*/, const Vector3d& v) {
  const Vector3d heading(std::cos(state_.q[2]), std::sin(state_.q[2]), 0.0);
  state_.xi.head<2>() += CalcDriveVelocityOfTwist(model_->base(), {v.dot(heading), 0.0});
  state_.V_Bo.head<3>() += state_.X_Bo.linear().transpose() * v;
}

void RigidPlant::Translate(const Vector3d& way) {
  state_.q.head<2>() += way.head<2>();
  state_.X_Bo.translation() += way;
}

}  // namespace dexcheck
