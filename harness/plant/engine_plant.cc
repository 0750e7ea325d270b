#include "harness/plant/engine_plant.h"

#include <algorithm>
#include <cmath>

#include "harness/engine/map_vector.h"
#include "harness/engine/velocity_map.h"
#include "harness/plant/plant.h"

namespace dexcheck {

EnginePlant::EnginePlant(const Adapter& adapter, std::span<const int> fingertips, const Surface& surface,
                         bool implicit_damping)
    : adapter_(&adapter),
      simulation_(adapter, implicit_damping),
      observer_(adapter, fingertips, surface),
      motors_(simulation_.ListMotors()) {}

void EnginePlant::Read(PlantReading* reading) {
  observer_.Read(simulation_, reading);
  const Eigen::Index bodies = simulation_.model().nbody;
  reading->body_positions = Eigen::Map<const VectorXd>(simulation_.data().xpos, 3 * bodies);
  reading->body_rotations = Eigen::Map<const VectorXd>(simulation_.data().xmat, 9 * bodies);
  reading->touch.support_force = support_force_;
  reading->evaluated = simulation_.is_changed() ? nullptr : &simulation_.data();
}

void EnginePlant::EndStep(const Eigen::Ref<const VectorXd>& tau) {
  simulation_.SetTorques(tau);
  simulation_.EndStep();
}

void EnginePlant::Read(PlantResponse* response) {
  observer_.Read(simulation_, response);
  simulation_.ReadMotorTorques(&response->motor_torques);
  support_force_ = response->support_force;
  response->contact_count = static_cast<int>(simulation_.data().ncon);
  response->constraint_rows = static_cast<int>(simulation_.data().nefc);
  response->collision = FindCollision();
}

void EnginePlant::WatchCollisions(std::span<const std::pair<int, int>> geoms) {
  colliding_.clear();
  for (const auto& [a, b] : geoms) colliding_.emplace_back(std::min(a, b), std::max(a, b));
  std::ranges::sort(colliding_);
}

Collision EnginePlant::FindCollision() const {
  Collision largest;
  if (colliding_.empty()) return largest;
  const mjData& d = simulation_.data();
  for (int i = 0; i < d.ncon; ++i) {
    const mjContact& contact = d.contact[i];
    const std::pair<int, int> geoms = std::minmax(contact.geom1, contact.geom2);
    if (!std::binary_search(colliding_.begin(), colliding_.end(), geoms)) continue;
    mjtNum force[6];
    mj_contactForce(&simulation_.model(), &d, i, force);
    const double size = mju_norm3(force);
    if (size > largest.force) largest = {size, geoms.first, geoms.second};
  }
  return largest;
}

void EnginePlant::Place(const Eigen::Ref<const VectorXd>& q, const Pose& X_Bo) {
  EngineState state = simulation_.GetState();
  state.qvel.setZero();
  state.qacc_warmstart.setZero();
  adapter_->SetPositions(q, state.qpos.data());
  if (adapter_->object_body() >= 0) WriteFreePose(X_Bo, state.qpos.data() + adapter_->object_qpos());
  simulation_.SetState(state);
}

void EnginePlant::AddVelocity(const MeasuredState& state, const Vector3d& v) {
  const mjModel& m = adapter_->engine();
  const RobotModel& model = adapter_->model();
  const Vector3d heading(std::cos(state.q[2]), std::sin(state.q[2]), 0.0);
  EngineState moving = simulation_.GetState();
  VectorXd xi = VectorXd::Zero(model.num_velocities());
  xi.head<2>() = CalcDriveVelocityOfTwist(model.base(), {v.dot(heading), 0.0});
  VelocityMap map(*adapter_, Coordinates::kReduced);
  map.SetState(state.q, xi);
  VectorXd added = VectorXd::Zero(m.nv);
  map.Expand(xi, added.data());
  added.segment<3>(adapter_->object_dof()) = v;
  moving.qvel += added;
  simulation_.SetState(moving);
}

void EnginePlant::Translate(const Vector3d& way) {
  const mjModel& m = adapter_->engine();
  EngineState moved = simulation_.GetState();
  moved.qpos.segment<2>(m.jnt_qposadr[adapter_->base_joints()[0]]) += way.head<2>();
  moved.qpos.segment<3>(adapter_->object_qpos()) += way;
  simulation_.SetState(moved);
}

}  // namespace dexcheck
