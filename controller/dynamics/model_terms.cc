// Kinematics: where the links are and how they move (section 2).

#include "controller/dynamics/model_terms.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace dexcheck {
namespace {

void CheckSize(const char* name, Eigen::Index expected, Eigen::Index actual) {
  if (expected == actual) return;
  throw std::invalid_argument(std::string(name) + ": " + std::to_string(expected) +
                              " entries expected, got " + std::to_string(actual));
}

}  // namespace

ModelTerms::ModelTerms(const RobotModel& model, Coordinates coordinates)
    : model_(&model),
      base_size_(coordinates == Coordinates::kReduced ? model.num_base_velocities()
                                                      : model.num_unreduced_base_velocities()),
      size_(base_size_ + model.num_dofs()) {
  const auto add_mass = [this](const MassProperties& body) {
    // Second moments about the link's origin: P = (tr(I)/2) 1 - I + m c c^T.
    const Matrix3d P = 0.5 * body.inertia.trace() * Matrix3d::Identity() - body.inertia +
                       body.mass * body.com * body.com.transpose();
    masses_.push_back(
        {body.mass, body.mass * body.com, {P(0, 0), P(0, 1), P(0, 2), P(1, 1), P(1, 2), P(2, 2)}});
  };
  add_mass(model.base().type == BaseType::kFixed ? MassProperties{} : model.base_with_wheels());
  for (const Joint& joint : model.joints()) {
    places_.push_back({joint.parent, joint.type, !joint.X_PB.isApprox(Pose::Identity(), 0.0),
                       std::cos(joint.mdh.alpha), std::sin(joint.mdh.alpha), joint.mdh.a, joint.mdh.q,
                       joint.mdh.d, joint.X_PB.linear(), joint.X_PB.translation()});
    add_mass(joint.body);
  }
  for (const Frame& frame : model.frames()) {
    // Chains count reduced coordinates; the base of unreduced ones may have more.
    std::vector<int>& chain = frame_chains_.emplace_back(model.ListMovingEntries(frame.link));
    chain.erase(chain.begin(), chain.begin() + model.num_base_velocities());
    for (int& entry : chain) entry += base_size_ - model.num_base_velocities();
  }

  if (model.base().type == BaseType::kDifferentialDrive) {
    // thetadot_r = (v_c + w_c b/2) / r,  thetadot_l = (v_c - w_c b/2) / r   (rolling, (12))
    const double r = model.base().wheel_radius;
    const double b = model.base().wheel_distance;
    wheel_map_ << 1.0 / r, 0.0, b / (2.0 * r), 1.0 / r, 0.0, -b / (2.0 * r);
  }

  velocity_ = VectorXd::Zero(size_);
  columns_.resize(static_cast<size_t>(size_));
  links_.resize(static_cast<size_t>(model.num_joints()) + 1);
  subtrees_.resize(links_.size());
  forces_.resize(links_.size());
  const int path_length = PaddedPathLength(base_size_ + model.max_depth());
  path_.setZero(12, path_length);
  path_dofs_.assign(static_cast<size_t>(path_length), 0);
  path_M_.setZero(path_length);
  path_C_column_.setZero(path_length);
  path_C_row_.setZero(path_length);
  M_.setZero(size_, size_);
  C_.setZero(size_, size_);
  coriolis_.setZero(size_);
  gravity_.setZero(size_);
  friction_.setZero(size_);
}

void ModelTerms::SetState(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& velocity) {
  CheckSize("q", model_->num_positions(), q.size());
  CheckSize("velocity", size_, velocity.size());
  velocity_ = velocity;
  SetBaseState(q, velocity);
  const int joints = model_->num_joints();
  for (int i = 0; i < joints; ++i) {
    const int at = model_->position_index(i);
    const int rates = base_size_ + model_->dof(i);
    if (places_[static_cast<size_t>(i)].type != JointType::kBall) {
      SetJointState(i, q[at], velocity[rates]);
    } else {
      const Eigen::Quaterniond turn(q[at], q[at + 1], q[at + 2], q[at + 3]);
      SetBallState(i, turn.normalized(), velocity.segment<3>(rates));
    }
  }
}

void ModelTerms::SetBaseState(const Eigen::Ref<const VectorXd>& q,
                              const Eigen::Ref<const VectorXd>& velocity) {
  const Base& base = model_->base();
  base_position_ = base.X_B0.translation();
  base_R_ = base.X_B0.linear();
  LinkState& state = links_[0];
  state = LinkState{};
  if (base.type == BaseType::kFixed) return;

  if (base.type == BaseType::kFloating) {
    base_position_ = q.head<3>();
    // Rotation of the normalised quaternion: states that were integrated have left the unit sphere a little.
    base_R_ = Eigen::Quaterniond(q[3], q[4], q[5], q[6]).normalized().toRotationMatrix();
    state.v = base_R_.transpose() * velocity.head<3>();
    state.w = velocity.segment<3>(3);
    SetFloatingColumns();
    return;
  }
  phi_ = q[2];
  base_position_ += Vector3d(q[0], q[1], 0.0);
  base_R_ = Eigen::AngleAxisd(phi_, Vector3d::UnitZ()).toRotationMatrix();

  // The base's own velocity in Sigma_0's axes.
  if (base_size_ == 3) {
    state.v = base_R_.transpose() * Vector3d(velocity[0], velocity[1], 0.0);
    state.w.z() = velocity[2];
  } else if (base.velocity == DriveVelocity::kTwist) {
    state.v.x() = velocity[0];
    state.w.z() = velocity[1];
  } else {
    state.v.x() = 0.5 * base.wheel_radius * (velocity[0] + velocity[1]);
    state.w.z() = base.wheel_radius / base.wheel_distance * (velocity[0] - velocity[1]);
  }
  SetBaseColumns(state.v);
  const Vector3d twist(state.v.x(), state.v.y(), state.w.z());
  wheel_rates_ = wheel_map_ * twist;
}

void ModelTerms::SetFloatingColumns() {
  // Along the world's axes, which stand still, and about Sigma_0's axes e, which move: such a column has
  // w = e and v = -e x origin, so w_dot = w_0 x e and, now that the origin is zero, v_dot = v_0 x e.
  const LinkState& base = links_[0];
  for (int i = 0; i < 3; ++i) {
    Column& along = columns_[static_cast<size_t>(i)];
    along = Column{};
    along.v = base_R_.row(i).transpose();
    Column& about = columns_[static_cast<size_t>(3 + i)];
    about = Column{};
    about.w = Vector3d::Unit(i);
    about.w_dot = base.w.cross(about.w);
    about.v_dot = base.v.cross(about.w);
  }
}

void ModelTerms::SetBaseColumns(const Vector3d& base_linear_velocity) {
  // Yaw about Sigma_0's z axis, which moves: the column's v is -z x origin, zero now, changing with the
  // origin.
  Column yaw;
  yaw.w = Vector3d::UnitZ();
  yaw.v_dot = base_linear_velocity.cross(Vector3d::UnitZ());
  if (base_size_ == 3) {
    columns_[0] = Column{};
    columns_[0].v = base_R_.row(0).transpose();  // the world's x axis in Sigma_0
    columns_[1] = Column{};
    columns_[1].v = base_R_.row(1).transpose();
    columns_[2] = yaw;
    return;
  }
  // S_v = [cos phi, 0; sin phi, 0; 0, 1] turns with the platform: d/dt x_0 = w_c z x x_0.
  Column forward;
  forward.v = Vector3d::UnitX();
  forward.v_dot = links_[0].w.z() * Vector3d::UnitY();
  if (model_->base().velocity == DriveVelocity::kTwist) {
    columns_[0] = forward;
    columns_[1] = yaw;
    return;
  }
  // v_c = r/2 (thetadot_r + thetadot_l),  w_c = r/b (thetadot_r - thetadot_l)
  const double half_r = 0.5 * model_->base().wheel_radius;
  const double turn = model_->base().wheel_radius / model_->base().wheel_distance;
  for (int side = 0; side < 2; ++side) {
    const double sign = side == 0 ? 1.0 : -1.0;
    Column& column = columns_[static_cast<size_t>(side)];
    column.w = sign * turn * yaw.w;
    column.v = half_r * forward.v;
    column.w_dot.setZero();
    column.v_dot = half_r * forward.v_dot + sign * turn * yaw.v_dot;
  }
}

void ModelTerms::SetJointState(int joint, double q, double rate) {
  const JointPlace& place = places_[static_cast<size_t>(joint)];
  const LinkState& parent = link(place.parent);
  LinkState& state = links_[static_cast<size_t>(joint + 1)];

  Matrix3d R_B = parent.R;
  Vector3d p_B = parent.p;
  if (place.has_offset) {
    R_B = parent.R * place.R_offset;
    p_B += parent.R * place.p_offset;
  }
  // ^{i-1}T_i of (4), column by column: the row's y and z axes after Rot(x, alpha), then Rot(z, theta).
  const bool revolute = place.type == JointType::kRevolute;
  const double theta = revolute ? place.q + q : place.q;
  const double d = revolute ? place.d : place.d + q;
  const double c = std::cos(theta);
  const double s = std::sin(theta);
  const Vector3d x = R_B.col(0);
  const Vector3d y = place.cos_alpha * R_B.col(1) + place.sin_alpha * R_B.col(2);
  const Vector3d z = place.cos_alpha * R_B.col(2) - place.sin_alpha * R_B.col(1);
  state.R.col(0) = c * x + s * y;
  state.R.col(1) = c * y - s * x;
  state.R.col(2) = z;
  state.p = p_B + place.a * x + d * z;

  // The joint's column rides on the parent: S_dot = V_parent x S.
  Column& S = joint_column(joint);
  if (revolute) {
    S.w = z;
    S.v = state.p.cross(z);
    S.w_dot = parent.w.cross(z);
    S.v_dot = parent.w.cross(S.v) + parent.v.cross(z);
  } else {
    S.w.setZero();
    S.v = z;
    S.w_dot.setZero();
    S.v_dot = parent.w.cross(z);
  }
  state.w = parent.w + rate * S.w;
  state.v = parent.v + rate * S.v;
}

void ModelTerms::SetBallState(int joint, const Eigen::Quaterniond& turn, const Vector3d& rates) {
  const JointPlace& place = places_[static_cast<size_t>(joint)];
  const LinkState& parent = link(place.parent);
  LinkState& state = links_[static_cast<size_t>(joint + 1)];
  state.R = parent.R * place.R_offset * turn.toRotationMatrix();
  state.p = parent.p + parent.R * place.p_offset;
  // The columns ride on the link itself: S_dot = V x S with V = V_parent + sum of rate_k S_k.
  const Vector3d w = state.R * rates;
  state.w = parent.w + w;
  state.v = parent.v + state.p.cross(w);
  for (int k = 0; k < 3; ++k) {
    Column& S = joint_column(joint, k);
    S.w = state.R.col(k);
    S.v = state.p.cross(S.w);
    S.w_dot = state.w.cross(S.w);
    S.v_dot = state.w.cross(S.v) + state.v.cross(S.w);
  }
}

Pose ModelTerms::CalcLinkPose(int joint) const {
  const LinkState& state = link(joint);
  Pose X;
  X.linear() = base_R_ * state.R;
  X.translation() = base_position_ + base_R_ * state.p;
  X.makeAffine();
  return X;
}

Vector6d ModelTerms::CalcLinkVelocity(int joint) const {
  const LinkState& state = link(joint);
  Vector6d velocity;
  velocity.head<3>() = base_R_ * (state.v + state.w.cross(state.p));
  velocity.tail<3>() = base_R_ * state.w;
  return velocity;
}

Pose ModelTerms::CalcFramePose(int frame) const {
  const Frame& f = model_->frame(frame);
  return CalcLinkPose(f.link) * f.X_LF;
}

void ModelTerms::CalcFrameJacobian(int frame, Eigen::Ref<Matrix6Xd> J, Eigen::Ref<Matrix6Xd> J_dot) const {
  J.setZero();
  J_dot.setZero();
  CalcFrameColumns(frame, J, J_dot);
}

void ModelTerms::CalcFrameColumns(int frame, Eigen::Ref<Matrix6Xd> J, Eigen::Ref<Matrix6Xd> J_dot) const {
  CheckSize("J columns", size_, J.cols());
  CheckSize("J_dot columns", size_, J_dot.cols());
  const Frame& f = model_->frame(frame);
  const LinkState& state = link(f.link);
  const Matrix3d R_f = state.R * f.X_LF.linear();
  const Vector3d p = state.p + state.R * f.X_LF.translation();
  const Vector3d w = state.w;
  const Vector3d p_dot = state.v + w.cross(p);

  // Column i of the body Jacobian: R_f^T [v_i + w_i x p; w_i]; R_f turns with w.
  const auto write = [&](int dof) {
    const Column& column = columns_[static_cast<size_t>(dof)];
    const Vector3d linear = column.v + column.w.cross(p);
    const Vector3d linear_dot = column.v_dot + column.w_dot.cross(p) + column.w.cross(p_dot);
    J.col(dof).head<3>().noalias() = R_f.transpose() * linear;
    J.col(dof).tail<3>().noalias() = R_f.transpose() * column.w;
    J_dot.col(dof).head<3>().noalias() = R_f.transpose() * (linear_dot - w.cross(linear));
    J_dot.col(dof).tail<3>().noalias() = R_f.transpose() * (column.w_dot - w.cross(column.w));
  };
  for (int i = 0; i < base_size_; ++i) write(i);
  for (const int dof : frame_chains_[static_cast<size_t>(frame)]) write(dof);
}

}  // namespace dexcheck
