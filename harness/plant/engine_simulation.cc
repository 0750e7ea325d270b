#include "harness/plant/engine_simulation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/common/text.h"
#include "harness/engine/map_vector.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck {
namespace {

int FindMotor(const mjModel& model, int joint) {
  const auto refuse = [&](const std::string& got) {
    throw InputError("MJCF: joint " + Quote(NameOf(model, mjOBJ_JOINT, joint)) +
                     ": must have one motor, got " + got +
                     "; dexcheck import FILE.xml --motors --out COPY.xml writes a copy with one each");
  };
  int found = -1;
  for (int i = 0; i < model.nu; ++i) {
    if (model.actuator_trntype[i] != mjTRN_JOINT || model.actuator_trnid[2 * i] != joint) continue;
    if (found >= 0) refuse("several");
    found = i;
  }
  if (found < 0) refuse("none");
  return found;
}

VectorXd Copy(const mjtNum* values, EngineSize count) { return Eigen::Map<const VectorXd>(values, count); }

}  // namespace

EngineSimulation::EngineSimulation(const Adapter& adapter, bool implicit_damping)
    : adapter_(&adapter),
      model_(mj_copyModel(nullptr, &adapter.engine())),
      data_(MakeData(*model_)),
      damping_(VectorXd::Zero(model_->nv)) {
  if (!implicit_damping) {
    Eigen::Map<VectorXd> damping(model_->dof_damping, model_->nv);
    damping_ = damping;
    damping.setZero();
    model_->opt.integrator = mjINT_EULER;
  }
  // The sender of torques observes the limits; friction is added to the torques.
  std::fill_n(model_->actuator_ctrllimited, model_->nu, 0);
  std::fill_n(model_->actuator_forcelimited, model_->nu, 0);
  if (adapter.model().base().type == BaseType::kFloating) motors_.assign(6, -1);
  for (const EngineWheel& wheel : adapter.wheels()) motors_.push_back(FindMotor(*model_, wheel.joint));
  for (const int joint : adapter.joint_ids()) motors_.push_back(FindMotor(*model_, joint));
  for (const int motor : motors_)
    dofs_.push_back(motor < 0 ? -1 : model_->jnt_dofadr[model_->actuator_trnid[2 * motor]]);
}

void EngineSimulation::BeginStep() { mj_step1(model_.get(), data_.get()); }

void EngineSimulation::SetTorques(const Eigen::Ref<const VectorXd>& tau) {
  Require(tau.size() == static_cast<Eigen::Index>(motors_.size()), "length of tau'", "must be that of xi",
          tau.size());
  for (size_t i = 0; i < motors_.size(); ++i) {
    if (motors_[i] < 0) continue;
    data_->ctrl[motors_[i]] = tau[static_cast<Eigen::Index>(i)] / model_->actuator_gear[6 * motors_[i]];
  }
}

void EngineSimulation::Push(std::span<const Wrench> wrenches) {
  if (wrenches.empty() && !is_pushed_) return;
  std::fill_n(data_->xfrc_applied, 6 * model_->nbody, 0.0);
  for (const Wrench& w : wrenches) {
    const int body = w.body == Wrench::kObject ? adapter_->object_body()
                                               : adapter_->link_bodies()[static_cast<size_t>(w.body + 1)];
    // The engine's forces act at the centre of mass.
    const Vector3d arm = w.point - Eigen::Map<const Vector3d>(data_->xipos + 3 * body);
    Eigen::Map<Vector3d>(data_->xfrc_applied + 6 * body) += w.force;
    Eigen::Map<Vector3d>(data_->xfrc_applied + 6 * body + 3) += w.torque + arm.cross(w.force);
  }
  is_pushed_ = !wrenches.empty();
}

void EngineSimulation::ReadMotorTorques(VectorXd* tau) const {
  tau->resize(static_cast<Eigen::Index>(dofs_.size()));
  for (size_t i = 0; i < dofs_.size(); ++i) {
    (*tau)[static_cast<Eigen::Index>(i)] = dofs_[i] < 0 ? 0.0 : data_->qfrc_actuator[dofs_[i]];
  }
}

std::vector<Motor> EngineSimulation::ListMotors() const {
  std::vector<Motor> motors;
  for (const int motor : motors_) {
    if (motor < 0) {
      motors.push_back({"base", std::numeric_limits<double>::infinity()});
      continue;
    }
    const double gear = std::abs(model_->actuator_gear[6 * motor]);
    double limit = std::numeric_limits<double>::infinity();
    // The engine cuts off the control and, for a motor with gain 1, the force as well.
    const auto cut = [&](auto limited, const mjtNum* range) {
      if (limited != 0) limit = std::min(limit, gear * std::min(-range[0], range[1]));
    };
    cut(adapter_->engine().actuator_ctrllimited[motor], model_->actuator_ctrlrange + 2 * motor);
    cut(adapter_->engine().actuator_forcelimited[motor], model_->actuator_forcerange + 2 * motor);
    motors.push_back({NameOf(*model_, mjOBJ_JOINT, model_->actuator_trnid[2 * motor]), limit});
  }
  return motors;
}

void EngineSimulation::EndStep() {
  const double expected_time = data_->time + time_step();
  Eigen::Map<VectorXd>(data_->qfrc_applied, model_->nv) =
      -damping_.cwiseProduct(Eigen::Map<const VectorXd>(data_->qvel, model_->nv));
  mj_step2(model_.get(), data_.get());
  CheckHealth(expected_time);
}

void EngineSimulation::CheckHealth(double expected_time) const {
  // After a bad position, velocity or acceleration the engine warns and starts over, at time zero.
  for (int i = 0; i < mjNWARNING; ++i) {
    if (data_->warning[i].number == 0) continue;
    throw DivergenceError("MuJoCo at t = " + FormatNumber(data_->time, 6) +
                          " s: " + DescribeWarning(*data_, i));
  }
  const bool finite = Eigen::Map<const VectorXd>(data_->qpos, model_->nq).allFinite() &&
                      Eigen::Map<const VectorXd>(data_->qvel, model_->nv).allFinite();
  if (finite && std::abs(data_->time - expected_time) < 0.5 * time_step()) return;
  throw DivergenceError(
      "the simulation's state is not finite after t = " + FormatNumber(expected_time - time_step()) + " s");
}

void EngineSimulation::Change(const std::function<void(mjModel*)>& change) {
  is_changed_ = true;
  change(model_.get());
  DeriveConstants(model_.get());
}

void DeriveConstants(mjModel* model) {
  // mj_setConst would join bodies where they touch at qpos0, not where they were joined.
  const VectorXd joined = Copy(model->eq_data, mjNEQDATA * model->neq);
  const MjDataPtr scratch = MakeData(*model);
  mj_setConst(model, scratch.get());
  std::copy_n(joined.data(), joined.size(), model->eq_data);
}

EngineState EngineSimulation::GetState() const {
  return {Copy(data_->qpos, model_->nq), Copy(data_->qvel, model_->nv), Copy(data_->act, model_->na),
          Copy(data_->qacc_warmstart, model_->nv), data_->time};
}

void EngineSimulation::SetState(const EngineState& state) {
  mj_resetData(model_.get(), data_.get());
  std::copy_n(state.qpos.data(), model_->nq, data_->qpos);
  std::copy_n(state.qvel.data(), model_->nv, data_->qvel);
  std::copy_n(state.act.data(), model_->na, data_->act);
  std::copy_n(state.qacc_warmstart.data(), model_->nv, data_->qacc_warmstart);
  data_->time = state.time;
}

BodyContact ReadContact(const mjModel& m, const mjData& d, int contact, bool first) {
  const mjContact& c = d.contact[contact];
  BodyContact result;
  result.touching = true;
  result.distance = c.dist;
  // Velocity of the second geom against the first, along the contact's tangents.
  const RotationMap frame(c.frame);
  const mjtNum* const velocity = d.efc_vel + c.efc_address;
  result.slip = (velocity[1] * frame.row(1) + velocity[2] * frame.row(2)).transpose();
  if (first) result.slip = -result.slip;
  mjtNum force[6];
  mj_contactForce(&m, &d, contact, force);
  const double tangential = std::hypot(force[1] / c.friction[0], force[2] / c.friction[1]);
  result.cone_use = force[0] > 0.0 ? tangential / force[0] : 0.0;
  result.cone_margin = c.friction[0] * (force[0] - tangential);
  return result;
}

BodyContact ReadBodyContact(const mjModel& m, const mjData& d, int body, int other) {
  BodyContact result;
  for (int i = 0; i < d.ncon; ++i) {
    const mjContact& c = d.contact[i];
    const int body1 = m.geom_bodyid[c.geom1];
    const int body2 = m.geom_bodyid[c.geom2];
    const bool first = body1 == body && body2 == other;
    const bool second = body2 == body && body1 == other;
    if ((!first && !second) || c.efc_address < 0 || c.dim < 3) continue;
    if (!result.touching || c.dist < result.distance) result = ReadContact(m, d, i, first);
  }
  return result;
}

}  // namespace dexcheck
