#include "harness/checks/whole_robot.h"

#include <cmath>
#include <utility>

#include "controller/common/text.h"
#include "harness/base/worst.h"
#include "harness/engine/map_vector.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck {
namespace {

Joint MakeWheel(const Base& base, const std::string& name, double side) {
  Joint wheel;
  wheel.name = wheel.link = name;
  wheel.X_PB.translation().y() = 0.5 * side * base.wheel_distance;
  // z_i is the axle, +y of Sigma_0.
  wheel.mdh.alpha = -0.5 * kPi;
  wheel.lower = -kPi;
  wheel.upper = kPi;
  wheel.damping = base.wheel.damping;
  wheel.armature = base.wheel.armature;
  wheel.body.mass = base.wheel.mass;
  wheel.body.inertia =
      Vector3d(base.wheel.transverse_inertia, base.wheel.transverse_inertia, base.wheel.spin_inertia)
          .asDiagonal();
  return wheel;
}

}  // namespace

RobotModel MakeWholeRobot(const RobotModel& model, const Adapter& adapter) {
  RobotSpec spec = model.spec();
  spec.object.reset();
  if (spec.base.type == BaseType::kFixed) return RobotModel(std::move(spec));
  Base& base = spec.base;
  if (base.type == BaseType::kDifferentialDrive) {
    for (Joint& joint : spec.joints) {
      if (joint.parent >= 0) joint.parent += 2;
      if (joint.coupling) joint.coupling->leader += 2;
    }
    for (Frame& frame : spec.frames) {
      if (frame.link >= 0) frame.link += 2;
    }
    spec.joints.insert(spec.joints.begin(), {MakeWheel(base, base.wheel_joint_right, -1.0),
                                             MakeWheel(base, base.wheel_joint_left, 1.0)});
  }
  const bool is_free = adapter.base_joints().size() == 1;
  const Pose X_b0 = adapter.X_0b().inverse(Eigen::Isometry);
  base.body = ExpressIn(base.body, X_b0);
  for (Joint& joint : spec.joints) {
    if (joint.parent < 0) joint.X_PB = X_b0 * joint.X_PB;
  }
  for (Frame& frame : spec.frames) {
    if (frame.link < 0) frame.X_LF = X_b0 * frame.X_LF;
  }
  base.type = is_free ? BaseType::kFloating : BaseType::kPlanar;
  base.X_B0 = is_free ? Pose::Identity() : base.X_B0 * adapter.X_0b();
  base.wheel = {};
  base.wheel_joint_right.clear();
  base.wheel_joint_left.clear();
  return RobotModel(std::move(spec));
}

WholeRobot::WholeRobot(const RobotModel& model, const MassProperties* object, const Adapter& adapter)
    : adapter_(&adapter),
      num_wheels_(static_cast<int>(adapter.wheels().size())),
      model_(MakeWholeRobot(model, adapter)),
      terms_(model_),
      scales_(model_) {
  if (object != nullptr && adapter.object_dof() >= 0) object_ = *object;
  const mjModel& engine = adapter.engine();
  for (const int joint : adapter.base_joints()) {
    const int count = engine.jnt_type[joint] == mjJNT_FREE ? 6 : 1;
    for (int k = 0; k < count; ++k) base_dofs_.push_back(engine.jnt_dofadr[joint] + k);
  }
  const auto base = static_cast<Eigen::Index>(base_dofs_.size());
  base_rates_.setIdentity(base, base);
  if (base == 3) {
    adapter.CalcBaseRates(Vector3d::UnitX(), 0.0, base_rates_.col(0));
    adapter.CalcBaseRates(Vector3d::UnitY(), 0.0, base_rates_.col(1));
    adapter.CalcBaseRates(Vector3d::Zero(), 1.0, base_rates_.col(2));
  }
  for (const EngineWheel& wheel : adapter.wheels()) {
    joints_.push_back(wheel.joint);
    dofs_.push_back(wheel.dof);
  }
  joints_.insert(joints_.end(), adapter.joint_ids().begin(), adapter.joint_ids().end());
  dofs_.insert(dofs_.end(), adapter.joint_dofs().begin(), adapter.joint_dofs().end());
  signs_.setOnes(static_cast<Eigen::Index>(dofs_.size()));
  for (size_t k = 0; k < adapter.wheels().size(); ++k) {
    if (adapter.wheels()[k].axis.y() < 0.0) signs_[static_cast<Eigen::Index>(k)] = -1.0;
  }
  // A floating base has entries of tau' without motors; a differential drive's are those of its wheels.
  if (model.base().type != BaseType::kDifferentialDrive)
    motor_entries_.assign(static_cast<size_t>(model.num_base_velocities()), -1);
  for (Eigen::Index k = 0; k < signs_.size(); ++k) motor_entries_.push_back(base + k);

  body_links_.assign(static_cast<size_t>(engine.nbody), kNoLink);
  for (size_t link = 0; link < adapter.welded_bodies().size(); ++link) {
    const int index = link == 0 ? -1 : static_cast<int>(link) - 1 + num_wheels_;
    for (const int body : adapter.welded_bodies()[link]) body_links_[static_cast<size_t>(body)] = index;
  }
  for (int b = 0; b < engine.nbody; ++b) {
    if (engine.body_weldid[b] == 0 && FindLink(b) == kNoLink) body_links_[static_cast<size_t>(b)] = kWorld;
    const int moving = engine.body_weldid[b];
    for (int k = 0; k < num_wheels_; ++k) {
      if (engine.jnt_bodyid[adapter.wheels()[static_cast<size_t>(k)].joint] == moving)
        body_links_[static_cast<size_t>(b)] = k;
    }
    if (object_ && moving == engine.body_weldid[adapter.object_body()])
      body_links_[static_cast<size_t>(b)] = kObject;
  }

  const Eigen::Index n = terms_.size(), all = n + (object_ ? 6 : 0);
  for (VectorXd* vector : {&arms_, &moved_, &bias_sizes_}) vector->setZero(n);
  for (int i = 0; i < static_cast<int>(n); ++i) {
    arms_[i] = scales_.CalcVelocityScale(i);
    moved_[i] = scales_.GetSubtreeMass(i) * arms_[i];
  }
  ListMass();
  q_.setZero(model_.num_positions());
  for (VectorXd* vector : {&nu_, &bias_, &engine_bias_}) vector->setZero(all);
  loads_.resize(static_cast<size_t>(model_.num_joints()) + 1);
}

void WholeRobot::ListMass() {
  const mjModel& engine = adapter_->engine();
  const Eigen::Index base = base_rates_.rows();
  const auto find_dof = [&](int entry) {
    if (entry >= base) return dofs_[static_cast<size_t>(entry - base)];
    return model_.base().type == BaseType::kFloating ? base_dofs_[static_cast<size_t>(entry)] : -1;
  };
  const auto find_address = [&](int row, int col) {
    int steps = 0;
    for (int dof = find_dof(row); dof >= 0; dof = engine.dof_parentid[dof], ++steps)
      if (dof == find_dof(col)) return FindMassEntry(engine, find_dof(row), steps);
    return -1;
  };
  const auto sign = [&](Eigen::Index entry) { return entry < base ? 1.0 : signs_[entry - base]; };
  for (int row = 0; row < static_cast<int>(terms_.size()); ++row) {
    for (const int col :
         model_.ListMovingEntries(row < base ? -1 : model_.joint_of_dof(row - static_cast<int>(base)))) {
      if (col <= row)
        mass_entries_.push_back(
            {row, col, scales_.CalcMassScale(row, col), find_address(row, col), sign(row) * sign(col)});
    }
  }
}

MatrixXd WholeRobot::CalcMassScales() const {
  MatrixXd result(terms_.size(), terms_.size());
  for (int i = 0; i < result.rows(); ++i)
    for (int j = 0; j < result.cols(); ++j) result(i, j) = scales_.CalcMassScale(i, j);
  return result;
}

std::string WholeRobot::DescribeEntry(int entry) const {
  const int base = model_.num_base_velocities(), n = model_.num_velocities();
  const auto describe = [](const std::string& body, int k) {
    return body + (k < 3 ? ", along " : ", about its ") + std::string(1, "xyz"[k % 3]);
  };
  if (entry >= n) return describe("object", entry - n);
  if (entry >= base) return "joint " + Quote(model_.dof_name(entry - base));
  return describe("base", base == 3 && entry == 2 ? 5 : entry);
}

void WholeRobot::SetState(const mjtNum* qpos, const mjtNum* qvel) {
  const mjModel& engine = adapter_->engine();
  if (model_.base().type == BaseType::kFloating) {
    mju_copy(q_.data(), qpos + engine.jnt_qposadr[adapter_->base_joints()[0]], 7);
  } else if (model_.base().type == BaseType::kPlanar) {
    const Pose X_W0 = adapter_->GetBasePose(qpos);
    q_.head<2>() = (X_W0 * adapter_->anchor() - model_.base().X_B0.translation()).head<2>();
    q_[2] = std::atan2(X_W0.linear()(1, 0), X_W0.linear()(0, 0));
  }
  for (int j = 0; j < model_.num_joints(); ++j) {
    const mjtNum* const position = qpos + engine.jnt_qposadr[engine_joint(j)];
    mju_copy(q_.data() + model_.position_index(j), position, CountPositions(model_.joint(j).type));
    if (j < num_wheels_) q_[model_.position_index(j)] *= signs_[j];
  }
  ReadRates(qvel, &nu_);
  const Eigen::Index n = terms_.size();
  terms_.SetState(q_, nu_.head(n));
  terms_.CalcMassAndCoriolis();
  scales_.SetState(terms_, q_, nu_.head(n));
  bias_.head(n) = terms_.coriolis() + terms_.gravity() + terms_.friction();
  const double acceleration = model_.gravity().norm() + scales_.acceleration();
  for (Eigen::Index i = 0; i < n; ++i)
    bias_sizes_[i] = Positive(moved_[i] * acceleration) + std::abs(terms_.friction()[i]);
  if (!object_) return;
  X_Bo_ = ReadFreePose(qpos + adapter_->object_qpos());
  const Vector3d omega = nu_.tail<3>();
  bias_.tail<6>() << -object_->mass * model_.gravity(), omega.cross(object_->inertia * omega);
}

void WholeRobot::AddInertia(const VectorXd& a, VectorXd* result) const {
  const Eigen::Index n = terms_.size();
  for (const MassEntry& one : mass_entries_) {
    const double entry = terms_.M()(one.row, one.col);
    (*result)[one.row] += entry * a[one.col];
    if (one.row != one.col) (*result)[one.col] += entry * a[one.row];
  }
  if (!object_) return;
  result->segment<3>(n) += object_->mass * a.segment<3>(n);
  result->tail<3>() += object_->inertia * a.tail<3>();
}

void WholeRobot::ReadRates(const mjtNum* rates, VectorXd* nu) const {
  const Eigen::Index base = base_rates_.rows();
  nu->head(base).setZero();
  for (Eigen::Index i = 0; i < base; ++i)
    nu->head(base) += rates[base_dofs_[static_cast<size_t>(i)]] * base_rates_.row(i).transpose();
  for (Eigen::Index k = 0; k < signs_.size(); ++k)
    (*nu)[base + k] = signs_[k] * rates[dofs_[static_cast<size_t>(k)]];
  if (object_) nu->tail<6>() = Eigen::Map<const Vector6d>(rates + adapter_->object_dof());
}

void WholeRobot::WriteForces(const VectorXd& forces, VectorXd* engine) const {
  engine->setZero();
  const Eigen::Index base = base_rates_.rows();
  for (Eigen::Index i = 0; i < base; ++i)
    (*engine)[base_dofs_[static_cast<size_t>(i)]] = base_rates_.row(i).dot(forces.head(base));
  for (Eigen::Index k = 0; k < signs_.size(); ++k)
    (*engine)[dofs_[static_cast<size_t>(k)]] = signs_[k] * forces[base + k];
}

void WholeRobot::ClearForces() {
  for (Load& load : loads_) load = {};
  object_load_ = {};
}

void WholeRobot::AddForce(const BodyForce& one) { AddForce(body_links_[static_cast<size_t>(one.body)], one); }

void WholeRobot::AddForce(int link, const BodyForce& one) {
  if (link == kNoLink || link == kWorld) return;
  const Vector3d origin = CalcLinkPose(link).translation();
  Load& load = link == kObject ? object_load_ : loads_[static_cast<size_t>(link + 1)];
  const Vector3d moment = one.torque + (one.point - origin).cross(one.force);
  load.force += one.force;
  load.moment += moment;
  load.size += one.force.norm() + moment.norm() / (link == kObject ? CalcObjectArm() : scales_.length());
}

void WholeRobot::ProjectForces(VectorXd* result, VectorXd* size) {
  const int base = model_.num_base_velocities();
  for (int j = model_.num_joints() - 1; j >= 0; --j) {
    const Load& load = loads_[static_cast<size_t>(j + 1)];
    if (load.size == 0.0) continue;
    const Joint& joint = model_.joint(j);
    const Pose X = terms_.CalcLinkPose(j);
    const Eigen::Index at = base + model_.dof(j);
    if (joint.type == JointType::kBall) {
      result->segment<3>(at) += X.linear().transpose() * load.moment;
    } else {
      (*result)[at] += X.linear().col(2).dot(joint.type == JointType::kRevolute ? load.moment : load.force);
    }
    for (int k = 0; k < CountVelocities(joint.type); ++k) (*size)[at + k] += load.size * arms_[at + k];
    Load& parent = loads_[static_cast<size_t>(joint.parent + 1)];
    const Vector3d origin = terms_.CalcLinkPose(joint.parent).translation();
    parent.force += load.force;
    parent.moment += load.moment + (X.translation() - origin).cross(load.force);
    parent.size += load.size;
  }
  const Load& load = loads_[0];
  if (base == 6) {
    result->head<3>() += load.force;
    result->segment<3>(3) += terms_.CalcLinkPose(-1).linear().transpose() * load.moment;
  } else if (base == 3) {
    result->head<3>() += Vector3d(load.force.x(), load.force.y(), load.moment.z());
  }
  size->head(base) += load.size * arms_.head(base);
  if (!object_) return;
  result->segment<3>(terms_.size()) += object_load_.force;
  result->tail<3>() += X_Bo_.linear().transpose() * object_load_.moment;
  size->segment<3>(terms_.size()).array() += object_load_.size;
  size->tail<3>().array() += object_load_.size * CalcObjectArm();
}

double WholeRobot::CalcObjectArm() const { return std::sqrt(object_->inertia.trace() / object_->mass); }

std::pair<double, int> WholeRobot::CompareMass(const VectorXd& mass) const {
  std::pair<double, int> worst(0.0, -1);
  for (const MassEntry& one : mass_entries_) {
    if (one.address < 0) continue;
    const double apart = std::abs(terms_.M()(one.row, one.col) - one.sign * mass[one.address]);
    const double error = apart / one.scale;
    if (IsWorse(error, worst.first)) worst = {error, static_cast<int>(one.row)};
  }
  return worst;
}

std::pair<double, int> WholeRobot::CompareBias(const VectorXd& bias) {
  ReadForces(bias.data(), &engine_bias_);
  std::pair<double, int> worst(0.0, -1);
  for (int i = 0; i < static_cast<int>(terms_.size()); ++i) {
    const double error = std::abs(bias_[i] - engine_bias_[i]) / bias_sizes_[i];
    if (IsWorse(error, worst.first)) worst = {error, i};
  }
  return worst;
}

void WholeRobot::AddSizes(const VectorXd& nu_dot, VectorXd* result) const {
  const Eigen::Index n = terms_.size();
  for (const MassEntry& one : mass_entries_) {
    (*result)[one.row] += one.scale * std::abs(nu_dot[one.col]);
    if (one.row != one.col) (*result)[one.col] += one.scale * std::abs(nu_dot[one.row]);
  }
  result->head(n) += bias_sizes_;
  if (!object_) return;
  const double force = object_->mass * (model_.gravity().norm() + nu_dot.segment<3>(n).norm());
  const double omega = nu_.tail<3>().norm();
  result->segment<3>(n).array() += force;
  result->tail<3>().array() +=
      force * CalcObjectArm() + object_->inertia.trace() * (nu_dot.tail<3>().norm() + omega * omega);
}

}  // namespace dexcheck
