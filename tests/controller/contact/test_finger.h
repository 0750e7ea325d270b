#pragma once

// A small serial finger with known Jacobians, and its rolling contact with an object that it moves.

#include <array>

#include "controller/contact/contact_geometry.h"
#include "controller/contact/grasp_map.h"
#include "controller/object/so3.h"
#include "tests/controller/contact/contact_fixtures.h"

namespace dexcheck::testing {

/// Serial chain g(q) = exp(S_1 q_1) ... exp(S_n q_n) g(0) of unit screws S_i = [v; omega] in the base frame.
class TestFinger {
 public:
  TestFinger() {
    // Four revolute joints along -z, as on a hand: one abduction axis, three parallel flexion axes.
    const std::array<Vector3d, 4> axes = {Vector3d::UnitX(), -Vector3d::UnitY(), -Vector3d::UnitY(),
                                          -Vector3d::UnitY()};
    const std::array<double, 4> heights = {0.0, -0.021, -0.04953, -0.07669};
    for (std::size_t i = 0; i < axes.size(); ++i) {
      screws_[i] << Vector3d(0.0, 0.0, heights[i]).cross(axes[i]), axes[i];
    }
    g_0_.translation() = Vector3d(0.0, 0.0, -0.09519);
  }

  [[nodiscard]] Pose CalcPose(const VectorXd& q) const {
    Pose g = Pose::Identity();
    for (int i = 0; i < 4; ++i) g = g * CalcScrewMotion(screws_[static_cast<std::size_t>(i)], q(i));
    return g * g_0_;
  }

  /// Body Jacobian (6x4) of the fingertip: column i is S_i seen from the fingertip.
  [[nodiscard]] Matrix6Xd CalcBodyJacobian(const VectorXd& q) const {
    Matrix6Xd J(6, 4);
    Pose g = g_0_;
    for (int i = 3; i >= 0; --i) {
      const Vector6d& S = screws_[static_cast<std::size_t>(i)];
      g = CalcScrewMotion(S, q(i)) * g;
      J.col(i) = CalcAdjointInverse(g) * S;
    }
    return J;
  }

 private:
  std::array<Vector6d, 4> screws_;
  Pose g_0_ = Pose::Identity();
};

/// The finger moves at q_dot, the object so that the fingertip rolls and spins on it without slip at t = 0.
class RollingFinger {
 public:
  RollingFinger(const Surface& fingertip, const Surface& object, std::mt19937& random,
                const ContactCoordinates& kappa)
      : fingertip_(fingertip), object_(object), kappa_(NormalizeContact(fingertip, object, kappa)) {
    q_ = Eigen::Vector4d(0.1, 0.4, 0.5, 0.6);
    q_dot_ = DrawVector(random, 4);
    X_BO_ = finger_.CalcPose(q_) * CalcTouchingPose(fingertip, object, kappa_).inverse();
    // V_o = Ad_{g_o_cf} (Ad_{g_cf_f} V_f - V_co_cf^cf)
    Vector6d V_relative;
    V_relative << Vector3d::Zero(), DrawVector(random, 3);
    const ContactGeometry contact = CalcContactGeometry(fingertip, object, kappa_);
    const Vector6d V_f = finger_.CalcBodyJacobian(q_) * q_dot_;
    V_o_ = CalcAdjoint(contact.g_o_cf) * (CalcAdjointInverse(contact.g_f_cf) * V_f - V_relative);
  }

  [[nodiscard]] const VectorXd& q_dot() const { return q_dot_; }
  [[nodiscard]] const Vector6d& V_o() const { return V_o_; }
  [[nodiscard]] Pose CalcFingertipPose(double t) const { return finger_.CalcPose(q_ + t * q_dot_); }
  [[nodiscard]] Pose CalcObjectPose(double t) const { return X_BO_ * CalcScrewMotion(V_o_, t); }
  [[nodiscard]] Matrix6Xd CalcBodyJacobian(double t) const {
    return finger_.CalcBodyJacobian(q_ + t * q_dot_);
  }

  /// The contact at time t, by closest points in the charts of t = 0; its rate from (40).
  [[nodiscard]] Contact CalcContact(double t) const {
    const Pose X_OF = CalcObjectPose(t).inverse() * CalcFingertipPose(t);
    Contact contact;
    contact.geometry =
        CalcContactGeometry(fingertip_, object_, FindContact(fingertip_, object_, X_OF, kappa_).kappa);
    const Vector6d V_f = CalcBodyJacobian(t) * q_dot_;
    contact.kappa_dot = CalcKappaDot(contact.geometry, CalcRelativeTwist(contact.geometry, V_f, V_o_));
    return contact;
  }

 private:
  const Surface& fingertip_;
  const Surface& object_;
  ContactCoordinates kappa_;
  TestFinger finger_;
  VectorXd q_;
  VectorXd q_dot_;
  Pose X_BO_;
  Vector6d V_o_;
};

}  // namespace dexcheck::testing
