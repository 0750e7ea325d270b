#include "controller/model/platform.h"

#include <Eigen/LU>
#include <cmath>

#include "controller/common/errors.h"

namespace dexcheck {

namespace {

void RequireDifferentialDrive(const Base& base) {
  Require(base.type == BaseType::kDifferentialDrive, "base type", "must be a differential drive", base.type);
  Require(base.wheel_radius > 0.0, "wheel_radius", "must be positive", base.wheel_radius);
  Require(base.wheel_distance > 0.0, "wheel_distance", "must be positive", base.wheel_distance);
}

// [v_c; w_c] from the wheel rates: r/2 [1, 1; 2/b, -2/b].
Matrix2d CalcTwistFromWheels(const Base& base) {
  const double r = base.wheel_radius;
  const double b = base.wheel_distance;
  Matrix2d T;
  T << r / 2, r / 2, r / b, -r / b;
  return T;
}

}  // namespace

PlatformConstraint CalcPlatformConstraint(const Base& base, const Vector3d& q_v, const Vector2d& v) {
  RequireDifferentialDrive(base);
  const double s = std::sin(q_v[2]);
  const double c = std::cos(q_v[2]);
  const double r = base.wheel_radius;
  const double b = base.wheel_distance;
  // [v_c; w_c] = T v
  const bool is_twist = base.velocity == DriveVelocity::kTwist;
  const Matrix2d T = is_twist ? Matrix2d(Matrix2d::Identity()) : CalcTwistFromWheels(base);
  const double phi_dot = T.row(1) * v;

  PlatformConstraint platform;
  // A_v = [-sin(phi), cos(phi), 0]
  platform.A_v << -s, c, 0.0;
  // S_v = [cos(phi), 0; sin(phi), 0; 0, 1] T
  Eigen::Matrix<double, 3, 2> S_twist;
  S_twist << c, 0.0, s, 0.0, 0.0, 1.0;
  platform.S_v = S_twist * T;
  // S_v_dot = phi_dot [-sin(phi), 0; cos(phi), 0; 0, 0] T
  Eigen::Matrix<double, 3, 2> S_twist_dot;
  S_twist_dot << -s, 0.0, c, 0.0, 0.0, 0.0;
  platform.S_v_dot = phi_dot * S_twist_dot * T;
  // tau^T thetadot = (E_v tau)^T q_v_dot,  r thetadot_r,l = cos(phi) x_c_dot + sin(phi) y_c_dot +- phi_dot
  // b/2
  platform.E_v << c / r, c / r, s / r, s / r, b / (2 * r), -b / (2 * r);
  platform.S_v_T_E_v = platform.S_v.transpose() * platform.E_v;
  return platform;
}

Matrix2d CalcWheelRateMap(const Base& base) {
  RequireDifferentialDrive(base);
  if (base.velocity == DriveVelocity::kWheelRates) return Matrix2d::Identity();
  // thetadot_r,l = (v_c +- w_c b/2) / r
  const double r = base.wheel_radius;
  const double b = base.wheel_distance;
  Matrix2d W;
  W << 1 / r, b / (2 * r), 1 / r, -b / (2 * r);
  return W;
}

ActuationMap::ActuationMap(const RobotModel& model)
    : size_(model.num_velocities()),
      has_wheels_(model.base().type == BaseType::kDifferentialDrive),
      floats_(model.base().type == BaseType::kFloating) {
  if (!has_wheels_) return;
  // tau^T thetadot = (S_v^T E_v tau)^T v with thetadot = W v
  S_v_T_E_v_ = CalcWheelRateMap(model.base()).transpose();
  inverse_ = S_v_T_E_v_.inverse();
}

void ActuationMap::Apply(const Matrix2d& wheels, const Eigen::Ref<const VectorXd>& from,
                         Eigen::Ref<VectorXd> to) const {
  Require(from.size() == size_ && to.size() == size_, "length of tau'", "must be that of xi", from.size());
  if (to.data() != from.data()) to = from;
  if (floats_) to.head<6>().setZero();
  if (has_wheels_) to.head<2>() = Vector2d(wheels * to.head<2>());
}

void ActuationMap::CalcForce(const Eigen::Ref<const VectorXd>& tau, Eigen::Ref<VectorXd> force) const {
  Apply(S_v_T_E_v_, tau, force);
}

void ActuationMap::CalcTorque(const Eigen::Ref<const VectorXd>& force, Eigen::Ref<VectorXd> tau) const {
  Apply(inverse_, force, tau);
}

}  // namespace dexcheck
