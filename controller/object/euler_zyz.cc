#include "controller/object/euler_zyz.h"

#include <array>
#include <cmath>
#include <cstdio>

#include "controller/common/errors.h"
#include "controller/object/so3.h"

namespace dexcheck {
namespace {

struct SinCos {
  explicit SinCos(double angle) : s(std::sin(angle)), c(std::cos(angle)) {}
  double s, c;
};

// omega = B(beta, gamma) [alpha_dot; beta_dot; gamma_dot], in the object's axes; det B = -sin(beta).
Matrix3d CalcAngularRateMap(const Vector3d& zyz) {
  const SinCos beta(zyz[1]);
  const SinCos gamma(zyz[2]);
  Matrix3d B;
  // clang-format off
  B << -beta.s * gamma.c, gamma.s, 0.0,
        beta.s * gamma.s, gamma.c, 0.0,
        beta.c,           0.0,     1.0;
  // clang-format on
  return B;
}

Matrix3d CalcAngularRateMapDot(const Vector3d& zyz, const Vector3d& zyz_dot) {
  const SinCos beta(zyz[1]);
  const SinCos gamma(zyz[2]);
  const double beta_dot = zyz_dot[1];
  const double gamma_dot = zyz_dot[2];
  Matrix3d B_dot;
  // clang-format off
  B_dot << -beta.c * gamma.c * beta_dot + beta.s * gamma.s * gamma_dot,  gamma.c * gamma_dot, 0.0,
            beta.c * gamma.s * beta_dot + beta.s * gamma.c * gamma_dot, -gamma.s * gamma_dot, 0.0,
           -beta.s * beta_dot,                                           0.0,                 0.0;
  // clang-format on
  return B_dot;
}

void CheckRegular(double beta, double sin_beta) {
  if (std::abs(sin_beta) >= kMinSinBeta) return;
  std::array<char, 160> message{};
  std::snprintf(
      message.data(), message.size(),
      "ZYZ angles are singular at sin(beta) = 0: beta = %.9g rad, sin(beta) = %.3g, needed |sin(beta)| >= %g",
      beta, sin_beta, kMinSinBeta);
  throw SingularityError(message.data(), beta);
}

// The angle that differs from `angle` by full turns and lies nearest `previous`.
double UnwrapNear(double angle, double previous) {
  return angle + 2.0 * kPi * std::round((previous - angle) / (2.0 * kPi));
}

Vector3d UnwrapNear(const Vector3d& zyz, const Vector3d& previous) {
  return {UnwrapNear(zyz[0], previous[0]), UnwrapNear(zyz[1], previous[1]), UnwrapNear(zyz[2], previous[2])};
}

}  // namespace

Matrix3d CalcRotationZyz(const Vector3d& zyz) {
  const SinCos alpha(zyz[0]);
  const SinCos beta(zyz[1]);
  const SinCos gamma(zyz[2]);
  Matrix3d R;
  // clang-format off
  R << alpha.c * beta.c * gamma.c - alpha.s * gamma.s, -alpha.c * beta.c * gamma.s - alpha.s * gamma.c, alpha.c * beta.s,
       alpha.s * beta.c * gamma.c + alpha.c * gamma.s, -alpha.s * beta.c * gamma.s + alpha.c * gamma.c, alpha.s * beta.s,
      -beta.s * gamma.c,                                beta.s * gamma.s,                               beta.c;
  // clang-format on
  return R;
}

Vector3d CalcZyzAngles(const Matrix3d& R_Bo) {
  RequireRotation(R_Bo, "R_Bo");
  const double sin_beta = std::hypot(R_Bo(0, 2), R_Bo(1, 2));
  const double beta = std::atan2(sin_beta, R_Bo(2, 2));
  CheckRegular(beta, sin_beta);
  return {std::atan2(R_Bo(1, 2), R_Bo(0, 2)), beta, std::atan2(R_Bo(2, 1), -R_Bo(2, 0))};
}

Vector3d CalcZyzAngles(const Matrix3d& R_Bo, const Vector3d& previous) {
  Require(previous.allFinite(), "previous ZYZ angles", "must be finite", previous.sum());
  const Vector3d zyz = CalcZyzAngles(R_Bo);
  const Vector3d upper = UnwrapNear(zyz, previous);
  const Vector3d lower = UnwrapNear({zyz[0] + kPi, -zyz[1], zyz[2] + kPi}, previous);
  return (upper - previous).squaredNorm() <= (lower - previous).squaredNorm() ? upper : lower;
}

Vector3d CalcAnyZyzAngles(const Matrix3d& R_Bo) {
  const double sin_beta = R_Bo.col(2).head<2>().norm();
  if (sin_beta >= kMinSinBeta) return CalcZyzAngles(R_Bo);
  RequireRotation(R_Bo, "R_Bo");
  // R = Rz(alpha) Ry(beta) Rz(gamma); gamma follows from the other two.
  const double alpha = sin_beta > 0.0 ? std::atan2(R_Bo(1, 2), R_Bo(0, 2)) : 0.0;
  const double beta = std::atan2(sin_beta, R_Bo(2, 2));
  const Matrix3d rest = CalcRotationZyz(Vector3d(alpha, beta, 0.0)).transpose() * R_Bo;
  return {alpha, beta, std::atan2(rest(1, 0), rest(0, 0))};
}

Pose CalcObjectPose(const Vector6d& X_o) {
  Pose X_Bo = Pose::Identity();
  X_Bo.translation() = X_o.head<3>();
  X_Bo.linear() = CalcRotationZyz(X_o.tail<3>());
  return X_Bo;
}

Vector6d CalcObjectCoordinates(const Pose& X_Bo, const Vector6d& previous) {
  Vector6d X_o;
  X_o << X_Bo.translation(), CalcZyzAngles(X_Bo.linear(), previous.tail<3>());
  return X_o;
}

Matrix6d CalcPInverse(const Vector6d& X_o) {
  // P^-1 = diag(R^T, B)
  const Vector3d zyz = X_o.tail<3>();
  Matrix6d P_inv = Matrix6d::Zero();
  P_inv.topLeftCorner<3, 3>() = CalcRotationZyz(zyz).transpose();
  P_inv.bottomRightCorner<3, 3>() = CalcAngularRateMap(zyz);
  return P_inv;
}

Matrix6d CalcPInverseDot(const Vector6d& X_o, const Vector6d& X_o_dot) {
  // d/dt R^T = -[omega]x R^T,  omega = B zyz_dot
  const Vector3d zyz = X_o.tail<3>();
  const Vector3d zyz_dot = X_o_dot.tail<3>();
  const Vector3d omega = CalcAngularRateMap(zyz) * zyz_dot;
  Matrix6d P_inv_dot = Matrix6d::Zero();
  P_inv_dot.topLeftCorner<3, 3>() = -Skew(omega) * CalcRotationZyz(zyz).transpose();
  P_inv_dot.bottomRightCorner<3, 3>() = CalcAngularRateMapDot(zyz, zyz_dot);
  return P_inv_dot;
}

Matrix6d CalcP(const Vector6d& X_o) {
  // P = diag(R, B^-1)
  const Vector3d zyz = X_o.tail<3>();
  Require(std::isfinite(zyz[1]), "beta", "must be finite", zyz[1]);
  const SinCos beta(zyz[1]);
  const SinCos gamma(zyz[2]);
  CheckRegular(zyz[1], beta.s);
  Matrix6d P = Matrix6d::Zero();
  P.topLeftCorner<3, 3>() = CalcRotationZyz(zyz);
  const double cot_beta = beta.c / beta.s;
  // clang-format off
  P.bottomRightCorner<3, 3>() << -gamma.c / beta.s,   gamma.s / beta.s,   0.0,
                                  gamma.s,            gamma.c,            0.0,
                                  cot_beta * gamma.c, -cot_beta * gamma.s, 1.0;
  // clang-format on
  return P;
}

}  // namespace dexcheck
