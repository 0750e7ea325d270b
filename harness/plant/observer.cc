#include "harness/plant/observer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/engine/map_vector.h"
#include "harness/engine/mujoco_release.h"
#include "harness/plant/plant.h"

namespace dexcheck {
namespace {

constexpr int kWorldBody = 0;

/// Force and torque of a contact on its second geom, along the world's axes.
std::pair<Vector3d, Vector3d> ReadForce(const mjModel& m, const mjData& d, int contact) {
  mjtNum wrench[6];  // in the contact's frame
  mj_contactForce(&m, &d, contact, wrench);
  const RotationMap frame(d.contact[contact].frame);
  return {frame.transpose() * MapVector(wrench), frame.transpose() * MapVector(wrench + 3)};
}

}  // namespace

void ReadConstraints(const mjData& d, PlantResponse* response) {
  response->engine_contacts.resize(static_cast<size_t>(d.ncon));
  for (int k = 0; k < d.ncon; ++k) {
    const mjContact& c = d.contact[k];
    EngineContact& contact = response->engine_contacts[static_cast<size_t>(k)];
    contact.geom1 = c.geom1, contact.geom2 = c.geom2, contact.dim = c.dim;
    contact.distance = c.dist, contact.margin = c.includemargin;
    contact.position = MapVector(c.pos);
    contact.frame = RotationMap(c.frame);
    std::ranges::copy(c.friction, contact.friction.begin());
    std::ranges::copy(c.solimp, contact.solimp.begin());
    std::ranges::copy(c.solref, contact.solref.begin());
    std::copy_n(GetFrictionReference(c), mjNREF, contact.solref_friction.begin());
  }
  response->rows.resize(static_cast<size_t>(d.nefc));
  for (int i = 0; i < d.nefc; ++i)
    response->rows[static_cast<size_t>(i)] = {d.efc_type[i], d.efc_id[i], d.efc_force[i]};
}

Observer::Observer(const Adapter& adapter, std::span<const int> fingertips, const Surface& surface)
    : adapter_(&adapter),
      fingertips_(fingertips.begin(), fingertips.end()),
      surface_(&surface),
      map_(adapter, Coordinates::kReduced) {
  for (const int frame : fingertips_) {
    const Frame& tip = adapter.model().frame(frame);
    tips_.emplace_back(tip.sphere_radius.value());
    tip_sites_.push_back(adapter.frame_sites()[static_cast<size_t>(frame)]);
    tip_geoms_.push_back(adapter.RequireTipGeom(frame));
  }
  for (const int site : tip_sites_) tip_bodies_.push_back(adapter.engine().site_bodyid[site]);
  for (const EngineWheel& wheel : adapter.wheels()) {
    wheel_bodies_.push_back(adapter.engine().jnt_bodyid[wheel.joint]);
  }
  constraint_force_.setZero(adapter.engine().nv);
}

Observer::BaseRates Observer::ReadBaseRates(const mjData& data) const {
  BaseRates rates;
  adapter_->GetBaseMotion(data.qpos, data.qvel, &rates.velocity, &rates.omega);
  // v_0 = v_A - omega x p_0A
  rates.velocity -= rates.omega.cross(X_W0_.linear() * adapter_->anchor());
  return rates;
}

void Observer::Read(const EngineSimulation& simulation, PlantReading* reading) {
  const mjModel& m = simulation.model();
  const mjData& d = simulation.data();
  qpos_ = Eigen::Map<const VectorXd>(d.qpos, m.nq);
  X_W0_ = adapter_->GetBasePose(d.qpos);
  rates_ = ReadBaseRates(d);
  // The coordinates of a floating base leave nothing out, and one that is fixed may hang from a ceiling.
  const BaseType base = adapter_->model().base().type;
  if (base != BaseType::kFloating && base != BaseType::kFixed) {
    const Vector3d up = X_W0_.linear().col(2);
    reading->departure.tilt = std::atan2(up.head<2>().norm(), up.z());
    reading->departure.height = X_W0_.translation().z() - adapter_->model().base().X_B0.translation().z();
  }
  reading->X_W0 = X_W0_;
  reading->qpos = qpos_;
  reading->qvel = Eigen::Map<const VectorXd>(d.qvel, m.nv);
  ReadState(d, &reading->state);
  if (bond_kappa_.empty()) {
    FindContacts(d, &reading->state);
  } else {
    reading->state.kappa = bond_kappa_;
    reading->state.overlap.assign(fingertips_.size(), 0.0);
  }
  reading->touch.fingertips = FindTouching(m, d);
}

void Observer::Read(const EngineSimulation& simulation, PlantResponse* response) {
  const mjModel& m = simulation.model();
  const mjData& d = simulation.data();
  ReadAccelerations(d, response);
  response->contacts.resize(fingertips_.size());
  if (bond_constraints_.empty()) {
    ReadContacts(m, d, &response->contacts);
  } else {
    ReadBonds(m, d, &response->contacts);
  }
  response->fingertips.resize(tip_bodies_.size());
  for (size_t i = 0; i < tip_bodies_.size(); ++i) {
    response->fingertips[i] = ReadBodyContact(m, d, tip_bodies_[i], adapter_->object_body());
  }
  response->wheels.resize(wheel_bodies_.size());
  for (size_t i = 0; i < wheel_bodies_.size(); ++i) {
    response->wheels[i] = ReadBodyContact(m, d, wheel_bodies_[i], kWorldBody);
  }
  ReadFeet(m, d, &response->feet);
  response->support_wrench = ReadSupportWrench(m, d);
  response->support_force = (X_Bo_.linear() * response->support_wrench.head<3>()).z();
  map_.SetState(q_, xi_);
  ReadDryFriction(d, &response->dry_friction);
  ReadJointLimits(m, d, &response->stop_force);
  ReadForces(m, d, response);
  ReadConstraints(d, response);
}

void Observer::ReadState(const mjData& data, MeasuredState* state) {
  const RobotModel& model = adapter_->model();
  state->q.resize(model.num_positions());
  state->xi.resize(model.num_velocities());
  adapter_->GetPositions(data.qpos, state->q);
  const int base = model.num_base_velocities();
  if (base == 6) {
    state->xi.head<6>() = Eigen::Map<const Vector6d>(data.qvel + map_.base_dofs().front());
  } else if (base == 3) {
    state->xi.head<3>() << rates_.velocity.x(), rates_.velocity.y(), rates_.omega.z();
  } else if (base == 2) {
    const Vector3d heading(std::cos(state->q[2]), std::sin(state->q[2]), 0.0);
    state->xi.head<2>() =
        CalcDriveVelocityOfTwist(model.base(), {heading.dot(rates_.velocity), rates_.omega.z()});
  }
  const std::vector<int>& dofs = adapter_->joint_dofs();
  for (size_t i = 0; i < dofs.size(); ++i) state->xi[base + static_cast<int>(i)] = data.qvel[dofs[i]];

  if (adapter_->object_body() >= 0) {
    const mjtNum* const rate = data.qvel + adapter_->object_dof();
    state->X_Bo = ReadFreePose(data.qpos + adapter_->object_qpos());
    state->V_Bo << state->X_Bo.linear().transpose() * MapVector(rate), MapVector(rate + 3);
  }
  q_ = state->q;
  xi_ = state->xi;
  if (model.num_base_positions() == 3) phi_ = state->q[2];
  X_Bo_ = state->X_Bo;
  V_Bo_ = state->V_Bo;
}

void Observer::FindContacts(const mjData& data, MeasuredState* state) {
  // Contacts where the plant's fingertips are.
  const Pose X_oB = state->X_Bo.inverse();
  const bool has_guess = !kappa_.empty();
  kappa_.resize(fingertips_.size());
  overlap_.resize(fingertips_.size());
  for (size_t i = 0; i < fingertips_.size(); ++i) {
    const int site = tip_sites_[i];
    const Pose X_Bf = MapPose(data.site_xmat + 9 * site, data.site_xpos + 3 * site);
    const Pose X_of = X_oB * X_Bf;
    const bool near = has_guess && overlap_[i] > -PlantReading::kFar;
    const FoundContact found =
        near ? FindContact(tips_[i], *surface_, X_of, kappa_[i]) : FindContact(tips_[i], *surface_, X_of);
    kappa_[i] = found.kappa;
    overlap_[i] = std::max(-found.gap, -PlantReading::kFar);
  }
  state->kappa = kappa_;
  state->overlap = overlap_;
}

void Observer::ReadAccelerations(const mjData& d, PlantResponse* response) const {
  const RobotModel& model = adapter_->model();
  VectorXd& xi_dot = response->xi_dot;
  xi_dot.resize(model.num_velocities());
  const int base = model.num_base_velocities();
  Vector3d linear, angular;
  adapter_->GetBaseMotion(qpos_.data(), d.qacc, &linear, &angular);
  const Vector3d arm = X_W0_.linear() * adapter_->anchor();
  // d/dt (v_A - omega x p_0A)
  linear -= angular.cross(arm) + rates_.omega.cross(rates_.omega.cross(arm));
  if (base == 6) {
    xi_dot.head<6>() = Eigen::Map<const Vector6d>(d.qacc + map_.base_dofs().front());
  } else if (base == 3) {
    xi_dot.head<3>() << linear.x(), linear.y(), angular.z();
  } else if (base == 2) {
    const Vector3d heading(std::cos(phi_), std::sin(phi_), 0.0);
    const Vector3d left(-heading.y(), heading.x(), 0.0);
    const double forward = heading.dot(linear) + rates_.omega.z() * left.dot(rates_.velocity);
    xi_dot.head<2>() = CalcDriveVelocityOfTwist(model.base(), {forward, angular.z()});
  }
  const std::vector<int>& dofs = adapter_->joint_dofs();
  for (size_t i = 0; i < dofs.size(); ++i) xi_dot[base + static_cast<int>(i)] = d.qacc[dofs[i]];

  if (adapter_->object_body() < 0) return;
  const mjtNum* const rate = d.qacc + adapter_->object_dof();
  // v = R^T p_dot, hence v_dot = R^T p_ddot - omega x v
  const Vector3d v = V_Bo_.head<3>();
  const Vector3d omega = V_Bo_.tail<3>();
  response->V_Bo_dot << X_Bo_.linear().transpose() * MapVector(rate) - omega.cross(v), MapVector(rate + 3);
}

void Observer::SetBonds(std::span<const ContactCoordinates> kappa, std::span<const int> constraints) {
  bond_kappa_.assign(kappa.begin(), kappa.end());
  bond_constraints_.assign(constraints.begin(), constraints.end());
}

void Observer::ReadBonds(const mjModel& m, const mjData& d, std::vector<PlantContact>* contacts) const {
  for (size_t i = 0; i < contacts->size(); ++i) {
    PlantContact& contact = (*contacts)[i];
    contact = PlantContact{};
    const int eq = bond_constraints_[i];
    for (int row = 0; row + 2 < d.nefc; ++row) {
      if (d.efc_type[row] != mjCNSTR_EQUALITY || d.efc_id[row] != eq) continue;
      // Three rows along the world's axes: place of the first body's point against the second's, and the
      // force on the first.
      contact.touching = true;
      contact.position = BodyPose(d, m.eq_obj2id[eq]) * MapVector(m.eq_data + mjNEQDATA * eq + 3);
      contact.distance = MapVector(d.efc_pos + row).norm();
      contact.force = -MapVector(d.efc_force + row);
      break;
    }
  }
}

void Observer::SetFeet(std::span<const int> frames) {
  for (const int frame : frames) foot_sites_.push_back(adapter_->frame_sites()[static_cast<size_t>(frame)]);
}

int Observer::FindFoot(const mjModel& m, const mjData& d, int body, const Vector3d& place) const {
  int found = -1;
  double nearest = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < foot_sites_.size(); ++i) {
    const int site = foot_sites_[i];
    if (m.body_weldid[m.site_bodyid[site]] != m.body_weldid[body]) continue;
    const double distance = (MapVector(d.site_xpos + 3 * site) - place).norm();
    if (distance >= nearest) continue;
    nearest = distance;
    found = static_cast<int>(i);
  }
  return found;
}

void Observer::ReadFeet(const mjModel& m, const mjData& d, std::vector<GroundContact>* feet) const {
  feet->assign(foot_sites_.size(), GroundContact{});
  for (int k = 0; k < d.ncon && !feet->empty(); ++k) {
    const mjContact& c = d.contact[k];
    if (c.efc_address < 0 || c.dim < 3) continue;
    const bool first = m.geom_type[c.geom2] == mjGEOM_PLANE;
    if (!first && m.geom_type[c.geom1] != mjGEOM_PLANE) continue;
    const int foot = FindFoot(m, d, m.geom_bodyid[first ? c.geom1 : c.geom2], MapVector(c.pos));
    if (foot < 0) continue;
    GroundContact& contact = (*feet)[static_cast<size_t>(foot)];
    const Vector3d others = contact.force;
    if (!contact.touching || c.dist < contact.distance)
      static_cast<BodyContact&>(contact) = ReadContact(m, d, k, first);
    contact.force = others + (first ? -1.0 : 1.0) * ReadForce(m, d, k).first;
  }
}

int Observer::FindFingertip(int geom) const {
  const auto found = std::ranges::find(tip_geoms_, geom);
  return found == tip_geoms_.end() ? -1 : static_cast<int>(found - tip_geoms_.begin());
}

ContactSet Observer::FindTouching(const mjModel& m, const mjData& d) const {
  const int object = adapter_->object_body();
  ContactSet touching = 0;
  for (int k = 0; k < d.ncon; ++k) {
    const mjContact& c = d.contact[k];
    if (m.geom_bodyid[c.geom1] != object && m.geom_bodyid[c.geom2] != object) continue;
    const int tip = FindFingertip(m.geom_bodyid[c.geom1] == object ? c.geom2 : c.geom1);
    if (tip >= 0) touching |= ContactSet{1} << tip;
  }
  return touching;
}

Vector6d Observer::ReadSupportWrench(const mjModel& m, const mjData& d) const {
  const int object = adapter_->object_body();
  Vector6d wrench = Vector6d::Zero();
  for (int k = 0; k < d.ncon; ++k) {
    const mjContact& c = d.contact[k];
    const bool first = m.geom_bodyid[c.geom1] == object;
    if (!first && m.geom_bodyid[c.geom2] != object) continue;
    if (FindFingertip(first ? c.geom2 : c.geom1) >= 0) continue;
    const Vector3d force = (first ? -1.0 : 1.0) * ReadForce(m, d, k).first;
    const Vector3d arm = MapVector(c.pos) - X_Bo_.translation();
    wrench.head<3>() += X_Bo_.linear().transpose() * force;
    wrench.tail<3>() += X_Bo_.linear().transpose() * arm.cross(force);
  }
  return wrench;
}

void Observer::ReadDryFriction(const mjData& d, VectorXd* friction) const {
  if (d.nf == 0) return friction->resize(0);
  friction->setZero(adapter_->model().num_velocities());
  for (int row = d.ne; row < d.ne + d.nf; ++row) {
    if (d.efc_type[row] != mjCNSTR_FRICTION_DOF) continue;  // of a tendon
    const Eigen::Index entry = FindEntry(d.efc_id[row]);
    if (entry >= 0) (*friction)[entry] = d.efc_force[row];
  }
}

void Observer::ReadJointLimits(const mjModel& m, const mjData& d, VectorXd* force) const {
  force->resize(0);
  // Limits come behind friction, and before contacts.
  for (int row = d.ne + d.nf; row < d.nefc && d.efc_type[row] <= mjCNSTR_LIMIT_TENDON; ++row) {
    if (d.efc_type[row] != mjCNSTR_LIMIT_JOINT) continue;
    const int joint = d.efc_id[row];
    const Eigen::Index entry = FindEntry(m.jnt_dofadr[joint]);
    if (entry < 0) continue;
    if (force->size() == 0) force->setZero(adapter_->model().num_velocities());
    const mjtNum q = d.qpos[m.jnt_qposadr[joint]];
    const bool is_lower = q - m.jnt_range[2 * joint] < m.jnt_range[2 * joint + 1] - q;
    (*force)[entry] = is_lower ? d.efc_force[row] : -d.efc_force[row];
  }
}

Eigen::Index Observer::FindEntry(int dof) const {
  const std::vector<int>& dofs = adapter_->joint_dofs();
  const auto joint = std::ranges::find(dofs, dof);
  return joint == dofs.end() ? -1 : adapter_->model().num_base_velocities() + (joint - dofs.begin());
}

void Observer::ReadForces(const mjModel& m, const mjData& d, PlantResponse* response) {
  response->qacc = Eigen::Map<const VectorXd>(d.qacc, m.nv);
  response->mass = Eigen::Map<const VectorXd>(GetMassEntries(d), m.nM);
  response->bias = Eigen::Map<const VectorXd>(d.qfrc_bias, m.nv) -
                   Eigen::Map<const VectorXd>(d.qfrc_passive, m.nv) -
                   Eigen::Map<const VectorXd>(d.qfrc_applied, m.nv);
  VectorXd& left = response->left_over;
  left.resize(m.nv);
  mj_mulM(&m, &d, left.data(), d.qacc);
  constraint_force_.setZero();  // the engine leaves it alone where nothing is constrained
  // Not qfrc_constraint, which the engine makes fit. The call uses the data's scratch space alone.
  mj_mulJacTVec(&m, const_cast<mjData*>(&d), constraint_force_.data(), d.efc_force);
  left -= Eigen::Map<const VectorXd>(d.qfrc_smooth, m.nv) + constraint_force_;

  response->forces.clear();
  for (int k = 0; k < d.ncon; ++k) {
    const mjContact& c = d.contact[k];
    if (c.efc_address < 0) continue;
    const auto [force, torque] = ReadForce(m, d, k);
    BodyForce one{m.geom_bodyid[c.geom2], MapVector(c.pos), force, torque};
    response->forces.push_back(one);
    response->forces.push_back({m.geom_bodyid[c.geom1], one.point, -one.force, -one.torque});
  }
  // Points that are joined: three rows along the world's axes, whose forces act on the first body's point.
  for (int row = 0; row + 2 < d.ne; ++row) {
    const int eq = d.efc_id[row];
    if (m.eq_type[eq] != mjEQ_CONNECT) continue;
    const Vector3d force = MapVector(d.efc_force + row);
    const auto place = [&](int body, const mjtNum* anchor) { return BodyPose(d, body) * MapVector(anchor); };
    const int first = m.eq_obj1id[eq], second = m.eq_obj2id[eq];
    const mjtNum* const anchors = m.eq_data + mjNEQDATA * eq;
    response->forces.push_back({first, place(first, anchors), force, Vector3d::Zero()});
    response->forces.push_back({second, place(second, anchors + 3), -force, Vector3d::Zero()});
    row += 2;
  }
}

void Observer::ReadContacts(const mjModel& m, const mjData& d, std::vector<PlantContact>* contacts) const {
  for (size_t i = 0; i < fingertips_.size(); ++i) {
    PlantContact& contact = (*contacts)[i];
    contact = PlantContact{};
    for (int k = 0; k < d.ncon; ++k) {
      const mjContact& c = d.contact[k];
      const bool first = c.geom1 == tip_geoms_[i] && m.geom_bodyid[c.geom2] == adapter_->object_body();
      const bool second = c.geom2 == tip_geoms_[i] && m.geom_bodyid[c.geom1] == adapter_->object_body();
      if (!first && !second) continue;
      if (contact.touching && c.dist >= contact.distance) continue;
      const double sign = first ? 1.0 : -1.0;
      contact.touching = true;
      contact.distance = c.dist;
      contact.position = MapVector(c.pos);
      contact.normal = sign * RotationMap(c.frame).row(0).transpose();
      contact.force = sign * ReadForce(m, d, k).first;
    }
  }
}

}  // namespace dexcheck
