#include "harness/engine/velocity_map.h"

#include <cmath>

namespace dexcheck {

VelocityMap::VelocityMap(const Adapter& adapter, Coordinates coordinates)
    : adapter_(&adapter),
      is_floating_(adapter.model().base().type == BaseType::kFloating),
      base_size_(coordinates == Coordinates::kReduced ? adapter.model().num_base_velocities()
                                                      : adapter.model().num_unreduced_base_velocities()) {
  const mjModel& engine = adapter.engine();
  for (const int joint : adapter.base_joints()) {
    const int dofs = engine.jnt_type[joint] == mjJNT_FREE ? 6 : 1;
    for (int k = 0; k < dofs; ++k) base_dofs_.push_back(engine.jnt_dofadr[joint] + k);
  }
  for (const EngineWheel& wheel : adapter.wheels()) base_dofs_.push_back(wheel.dof);
  const auto rows = static_cast<Eigen::Index>(base_dofs_.size());
  T_base_.setZero(rows, base_size_);
  bias_.setZero(rows);
  bracket_.setZero(rows);
  if (is_floating_) T_base_.setIdentity();
}

VelocityMap::BaseMotion VelocityMap::CalcColumnMotion(int column, const Vector3d& heading) const {
  const Base& base = adapter_->model().base();
  if (base_size_ == 3)
    return column < 2 ? BaseMotion{Vector3d::Unit(column), 0.0} : BaseMotion{Vector3d::Zero(), 1.0};
  if (base.velocity == DriveVelocity::kTwist) {
    return column == 0 ? BaseMotion{heading, 0.0} : BaseMotion{Vector3d::Zero(), 1.0};
  }
  // v_c = r/2 (thetadot_r + thetadot_l),  w_c = r/b (thetadot_r - thetadot_l)
  const double sign = column == 0 ? 1.0 : -1.0;
  return {0.5 * base.wheel_radius * heading, sign * base.wheel_radius / base.wheel_distance};
}

VelocityMap::BaseMotion VelocityMap::CalcBaseMotion(const Eigen::Ref<const VectorXd>& velocity,
                                                    const Vector3d& heading) const {
  BaseMotion motion;
  for (int i = 0; i < base_size_; ++i) {
    const BaseMotion column = CalcColumnMotion(i, heading);
    motion.linear += velocity[i] * column.linear;
    motion.yaw += velocity[i] * column.yaw;
  }
  return motion;
}

void VelocityMap::FillRates(const Vector3d& anchor_velocity, double yaw, double forward,
                            Eigen::Ref<VectorXd> rates) const {
  const auto wheels = static_cast<Eigen::Index>(adapter_->wheels().size());
  adapter_->CalcBaseRates(anchor_velocity, yaw, rates.head(rates.size() - wheels));
  for (Eigen::Index k = 0; k < wheels; ++k) {
    // thetadot = (v_c - w_c y) / r for a wheel at y on the axle
    const EngineWheel& wheel = adapter_->wheels()[static_cast<size_t>(k)];
    const double sign = wheel.axis.y() < 0.0 ? -1.0 : 1.0;
    rates[rates.size() - wheels + k] = sign * (forward - yaw * wheel.center.y()) / wheel.radius;
  }
}

void VelocityMap::SetState(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& velocity,
                           const Matrix3d& tilt) {
  if (base_size_ == 0 || is_floating_) return;
  const double phi = q[2];
  const Vector3d heading(std::cos(phi), std::sin(phi), 0.0);
  const Vector3d left(-heading.y(), heading.x(), 0.0);
  const Vector3d up = Vector3d::UnitZ();
  const Vector3d arm = adapter_->anchor().x() * heading + adapter_->anchor().y() * left;

  for (int i = 0; i < base_size_; ++i) {
    const BaseMotion column = CalcColumnMotion(i, heading);
    FillRates(column.linear + column.yaw * up.cross(arm), column.yaw, heading.dot(column.linear),
              T_base_.col(i));
  }
  const BaseMotion motion = CalcBaseMotion(velocity, heading);
  // T_dot velocity: reduced columns turn with the heading, so Sigma_0's origin accelerates sideways; the
  // anchor also has its centripetal acceleration. The yaw rate does not change.
  const bool turns = base_size_ == 2;
  const Vector3d acceleration =
      turns ? Vector3d(motion.yaw * heading.dot(motion.linear) * left) : Vector3d::Zero();
  const double forward_rate = heading.dot(acceleration) + motion.yaw * left.dot(motion.linear);
  FillRates(acceleration - motion.yaw * motion.yaw * arm, 0.0, forward_rate, bias_);
  if (adapter_->base_joints().size() > 1) return;
  // A free joint has its linear velocity along the world's axes.
  for (int i = 0; i < base_size_; ++i) T_base_.col(i).head<3>() = tilt * T_base_.col(i).head<3>().eval();
  bias_.head<3>() = tilt * bias_.head<3>().eval();
}

void VelocityMap::Expand(const Eigen::Ref<const VectorXd>& velocity, mjtNum* qvel) const {
  for (Eigen::Index row = 0; row < T_base_.rows(); ++row) {
    qvel[base_dofs_[static_cast<size_t>(row)]] = T_base_.row(row).dot(velocity.head(base_size_));
  }
  for (size_t i = 0; i < adapter_->joint_dofs().size(); ++i) {
    qvel[adapter_->joint_dofs()[i]] = velocity[base_size_ + static_cast<int>(i)];
  }
}

void VelocityMap::ExpandBias(mjtNum* qacc) const {
  for (Eigen::Index row = 0; row < bias_.size(); ++row)
    qacc[base_dofs_[static_cast<size_t>(row)]] = bias_[row];
  for (const int dof : adapter_->joint_dofs()) qacc[dof] = 0.0;
}

void VelocityMap::ExpandBracket(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& a,
                                const Eigen::Ref<const VectorXd>& b, mjtNum* qacc) {
  bracket_.setZero();
  if (is_floating_) {
    bracket_.tail<3>() = Vector3d(a.segment<3>(3)).cross(Vector3d(b.segment<3>(3)));
  } else if (base_size_ == 2) {
    // T_dot(a) turns b's forward velocity to the left; centripetal parts are the same both ways.
    const Vector3d heading(std::cos(q[2]), std::sin(q[2]), 0.0);
    const Vector3d left(-heading.y(), heading.x(), 0.0);
    const BaseMotion at_a = CalcBaseMotion(a, heading);
    const BaseMotion at_b = CalcBaseMotion(b, heading);
    FillRates((at_a.yaw * heading.dot(at_b.linear) - at_b.yaw * heading.dot(at_a.linear)) * left, 0.0, 0.0,
              bracket_);
  }
  for (Eigen::Index row = 0; row < bracket_.size(); ++row)
    qacc[base_dofs_[static_cast<size_t>(row)]] = bracket_[row];
  const RobotModel& model = adapter_->model();
  for (int i = 0; i < model.num_joints(); ++i) {
    mjtNum* const rate = qacc + adapter_->joint_dofs()[static_cast<size_t>(model.dof(i))];
    const Eigen::Index at = base_size_ + model.dof(i);
    if (model.joint(i).type != JointType::kBall) {
      *rate = 0.0;
    } else {
      const Vector3d bracket = Vector3d(a.segment<3>(at)).cross(Vector3d(b.segment<3>(at)));
      mju_copy3(rate, bracket.data());
    }
  }
}

void VelocityMap::ProjectForce(const mjtNum* force, Eigen::Ref<VectorXd> result) const {
  for (int i = 0; i < base_size_; ++i) {
    result[i] = 0.0;
    for (Eigen::Index row = 0; row < T_base_.rows(); ++row) {
      result[i] += T_base_(row, i) * force[base_dofs_[static_cast<size_t>(row)]];
    }
  }
  for (size_t i = 0; i < adapter_->joint_dofs().size(); ++i) {
    result[base_size_ + static_cast<int>(i)] = force[adapter_->joint_dofs()[i]];
  }
}

}  // namespace dexcheck
