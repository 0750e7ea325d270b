#pragma once

// The robot's kinetic and potential energy, written down the naive way for tests: every body by itself, its
// pose as a product of elementary 4x4 matrices from the world outward, its Jacobians with one column per
// joint. Cost grows with the cube of the number of joints. The scalar may be a dual number.

#include <cmath>
#include <vector>

#include "controller/model/robot_model.h"

namespace dexcheck::testing {

/// The bodies of a robot at one q', in q_dot' coordinates (no reduction).
template <typename T>
class NaiveDynamics {
 public:
  using Vector3 = Eigen::Matrix<T, 3, 1>;
  using Matrix3 = Eigen::Matrix<T, 3, 3>;
  using Matrix4 = Eigen::Matrix<T, 4, 4>;
  using VectorX = Eigen::Matrix<T, Eigen::Dynamic, 1>;
  using RowVectorX = Eigen::Matrix<T, 1, Eigen::Dynamic>;
  using Matrix3X = Eigen::Matrix<T, 3, Eigen::Dynamic>;
  using MatrixX = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>;

  /// A rigid body: centre of mass p and inertia about it in world axes; p_dot = J_p q_dot', w = J_w q_dot'.
  struct Body {
    T mass;
    Vector3 p;
    Matrix3 inertia;
    Matrix3X J_p;
    Matrix3X J_w;
  };

  NaiveDynamics(const RobotModel& model, const VectorX& q) : model_(model), q_(q) {
    PlaceLinks();
    const Base& base = model_.base();
    if (base.type != BaseType::kFixed) AddBody(-1, base.body);
    if (base.type == BaseType::kDifferentialDrive) {
      AddWheel(-0.5 * base.wheel_distance);
      AddWheel(0.5 * base.wheel_distance);
    }
    for (int i = 0; i < model_.num_joints(); ++i) AddBody(i, model_.joint(i).body);
  }

  [[nodiscard]] const std::vector<Body>& bodies() const { return bodies_; }

  /// M = sum m J_p^T J_p + J_w^T I J_w, and the rotors: armature times the square of the rate that it sees.
  [[nodiscard]] MatrixX CalcMassMatrix() const {
    MatrixX M = MatrixX::Zero(q_.size(), q_.size());
    for (const Body& body : bodies_) {
      M += body.mass * (body.J_p.transpose() * body.J_p) + body.J_w.transpose() * (body.inertia * body.J_w);
    }
    for (int i = 0; i < model_.num_joints(); ++i) {
      const int k = model_.num_base_positions() + i;
      M(k, k) += T(model_.joint(i).armature);
    }
    for (const RowVectorX& rate : wheel_rates_) {
      M += T(model_.base().wheel.armature) * (rate.transpose() * rate);
    }
    return M;
  }

  /// V = -sum m g . p
  [[nodiscard]] T CalcPotentialEnergy() const {
    T V(0.0);
    for (const Body& body : bodies_) {
      for (int i = 0; i < 3; ++i) V -= body.mass * T(model_.gravity()[i]) * body.p[i];
    }
    return V;
  }

  /// Half the power that viscous friction takes (Rayleigh's dissipation function); its gradient by the rates
  /// is the friction's part of F.
  template <typename Rate>
  [[nodiscard]] Rate CalcDissipation(const Eigen::Matrix<Rate, Eigen::Dynamic, 1>& q_dot) const {
    Rate sum(0.0);
    for (int i = 0; i < model_.num_joints(); ++i) {
      const Rate rate = q_dot[model_.num_base_positions() + i];
      sum += Rate(0.5 * model_.joint(i).damping) * rate * rate;
    }
    for (const RowVectorX& row : wheel_rates_) {
      Rate rate(0.0);
      for (int i = 0; i < 3; ++i) rate += Rate(row[i]) * q_dot[i];
      sum += Rate(0.5 * model_.base().wheel.damping) * rate * rate;
    }
    return sum;
  }

 private:
  /// From axis i towards axis j.
  static Matrix4 Rotate(int i, int j, const T& angle) {
    using std::cos;
    using std::sin;
    Matrix4 X = Matrix4::Identity();
    X(i, i) = X(j, j) = cos(angle);
    X(j, i) = sin(angle);
    X(i, j) = -sin(angle);
    return X;
  }
  static Matrix4 RotateX(const T& angle) { return Rotate(1, 2, angle); }
  static Matrix4 RotateZ(const T& angle) { return Rotate(0, 1, angle); }
  static Matrix4 Translate(const T& x, const T& y, const T& z) {
    Matrix4 X = Matrix4::Identity();
    X(0, 3) = x;
    X(1, 3) = y;
    X(2, 3) = z;
    return X;
  }

  void PlaceLinks() {
    const Pose& X_B0 = model_.base().X_B0;
    X_base_ = X_B0.matrix().template cast<T>();
    const int offset = model_.num_base_positions();
    if (offset == 3) X_base_ = Translate(q_[0], q_[1], T(0.0)) * X_base_ * RotateZ(q_[2]);
    for (int i = 0; i < model_.num_joints(); ++i) {
      const Joint& joint = model_.joint(i);
      const bool turns = joint.type == JointType::kRevolute;
      const T theta = T(joint.mdh.q) + (turns ? q_[offset + i] : T(0.0));
      const T d = T(joint.mdh.d) + (turns ? T(0.0) : q_[offset + i]);
      X_links_.push_back(link(joint.parent) * joint.X_PB.matrix().template cast<T>() *
                         RotateX(T(joint.mdh.alpha)) * Translate(T(joint.mdh.a), T(0.0), T(0.0)) *
                         RotateZ(theta) * Translate(T(0.0), T(0.0), d));
    }
  }

  [[nodiscard]] const Matrix4& link(int joint) const {
    return joint < 0 ? X_base_ : X_links_[static_cast<size_t>(joint)];
  }

  void AddBody(int joint, const MassProperties& properties) {
    const Matrix3 R = link(joint).template topLeftCorner<3, 3>();
    Body body;
    body.mass = T(properties.mass);
    body.p = link(joint).template topRightCorner<3, 1>() + R * properties.com.template cast<T>();
    body.inertia = R * properties.inertia.template cast<T>() * R.transpose();
    body.J_p = Matrix3X::Zero(3, q_.size());
    body.J_w = Matrix3X::Zero(3, q_.size());
    const int offset = model_.num_base_positions();
    if (offset == 3) {
      body.J_p(0, 0) = body.J_p(1, 1) = T(1.0);
      SetHinge(2, Vector3(T(0.0), T(0.0), T(1.0)), X_base_.template topRightCorner<3, 1>(), &body);
    }
    for (int i = joint; i >= 0; i = model_.joint(i).parent) {
      const Vector3 z = link(i).template block<3, 1>(0, 2);
      if (model_.joint(i).type == JointType::kRevolute) {
        SetHinge(offset + i, z, link(i).template topRightCorner<3, 1>(), &body);
      } else {
        body.J_p.col(offset + i) = z;
      }
    }
    bodies_.push_back(body);
  }

  // A body that turns about the axis z through o: p_dot = z x (p - o).
  static void SetHinge(int column, const Vector3& z, const Vector3& o, Body* body) {
    const Vector3 r = body->p - o;
    body->J_p.col(column) << z[1] * r[2] - z[2] * r[1], z[2] * r[0] - z[0] * r[2], z[0] * r[1] - z[1] * r[0];
    body->J_w.col(column) = z;
  }

  // A wheel at y on the axle rides on the platform and spins as its centre rolls along the heading:
  // r thetadot = cos(phi) x_dot + sin(phi) y_dot - y phi_dot.
  void AddWheel(double y) {
    const WheelProperties& wheel = model_.base().wheel;
    const Vector3d moments(wheel.transverse_inertia, wheel.spin_inertia, wheel.transverse_inertia);
    AddBody(-1, {wheel.mass, Vector3d(0.0, y, 0.0), moments.asDiagonal()});
    RowVectorX rate = RowVectorX::Zero(q_.size());
    const T per_radius(1.0 / model_.base().wheel_radius);
    rate[0] = X_base_(0, 0) * per_radius;
    rate[1] = X_base_(1, 0) * per_radius;
    rate[2] = T(-y) * per_radius;
    bodies_.back().J_w += X_base_.template block<3, 1>(0, 1) * rate;
    wheel_rates_.push_back(rate);
  }

  const RobotModel& model_;
  VectorX q_;
  Matrix4 X_base_;
  std::vector<Matrix4> X_links_;
  std::vector<Body> bodies_;
  std::vector<RowVectorX> wheel_rates_;  // thetadot = row q_dot', right wheel first
};

}  // namespace dexcheck::testing
