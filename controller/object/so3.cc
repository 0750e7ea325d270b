#include "controller/object/so3.h"

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <cstdio>

#include "controller/common/errors.h"

namespace dexcheck {

namespace {

// Below this angle, rad, the coefficients come from their Taylor series. There five terms are exact to
// rounding; above it the closed forms lose at most one digit to cancellation.
constexpr double kSeriesAngle = 0.1;

// Coefficients of J_l = I + a [phi]x + b [phi]x^2 and, with ' = d/dtheta, a'/theta and b'/theta.
struct JacobianCoefficients {
  double a, b, a1, b1;
};

JacobianCoefficients CalcJacobianCoefficients(double theta) {
  const double t = theta * theta;
  if (theta < kSeriesAngle) {
    // a = sum (-t)^k / (2k+2)!,  b = sum (-t)^k / (2k+3)!
    return {.a = 1.0 / 2 - t * (1.0 / 24 - t * (1.0 / 720 - t * (1.0 / 40320 - t / 3628800))),
            .b = 1.0 / 6 - t * (1.0 / 120 - t * (1.0 / 5040 - t * (1.0 / 362880 - t / 39916800))),
            .a1 = -1.0 / 12 + t * (1.0 / 180 - t * (1.0 / 6720 - t * (1.0 / 453600 - t / 47900160))),
            .b1 = -1.0 / 60 + t * (1.0 / 1260 - t * (1.0 / 60480 - t * (1.0 / 4989600 - t / 622702080)))};
  }
  const double s = std::sin(theta);
  const double c = std::cos(theta);
  const double half_s = std::sin(theta / 2);
  // a = (1 - cos) / theta^2,  b = (theta - sin) / theta^3
  return {.a = 2 * half_s * half_s / t,
          .b = (theta - s) / (t * theta),
          .a1 = (theta * s - 4 * half_s * half_s) / (t * t),
          .b1 = (3 * s - theta * c - 2 * theta) / (t * t * theta)};
}

}  // namespace

void RequireRotation(const Matrix3d& R, std::string_view name) {
  const Matrix3d defect = R.transpose() * R - Matrix3d::Identity();
  const double worst = defect.cwiseAbs().maxCoeff();
  Require(R.allFinite() && worst <= kRotationTolerance, name,
          "must be a rotation (largest |R^T R - I| too big)", worst);
  const double determinant = R.determinant();
  Require(determinant > 0.0, name, "must be a rotation (determinant +1)", determinant);
}

Matrix3d ExpSo3(const Vector3d& phi) {
  // exp = I + sin(theta)/theta [phi]x + (1 - cos(theta))/theta^2 [phi]x^2, where sin(theta)/theta = 1 - b
  // theta^2
  const double theta = phi.norm();
  const JacobianCoefficients k = CalcJacobianCoefficients(theta);
  const double sinc = theta < kSeriesAngle ? 1.0 - k.b * theta * theta : std::sin(theta) / theta;
  const Matrix3d phi_x = Skew(phi);
  return Matrix3d::Identity() + sinc * phi_x + k.a * phi_x * phi_x;
}

Vector3d LogSo3(const Matrix3d& R) {
  RequireRotation(R, "R");
  // Unit quaternion [w, u sin(theta/2)]: both of its parts keep all their digits between 0 and pi.
  Eigen::Quaterniond quaternion(R);
  quaternion.normalize();
  if (quaternion.w() < 0.0) quaternion.coeffs() = -quaternion.coeffs();
  const double sin_half = quaternion.vec().norm();
  const double cos_half = quaternion.w();
  // theta / sin(theta/2) tends to 2 at zero.
  const double factor = sin_half > 0.0 ? 2.0 * std::atan2(sin_half, cos_half) / sin_half : 2.0;
  return factor * quaternion.vec();
}

Matrix3d CalcLeftJacobian(const Vector3d& phi) {
  // J_l = I + a [phi]x + b [phi]x^2
  const JacobianCoefficients k = CalcJacobianCoefficients(phi.norm());
  const Matrix3d phi_x = Skew(phi);
  return Matrix3d::Identity() + k.a * phi_x + k.b * phi_x * phi_x;
}

Matrix3d CalcLeftJacobianInverse(const Vector3d& phi) {
  const double theta = phi.norm();
  Require(theta < 1.5 * kPi, "|phi|", "must be below 3 pi / 2 for the inverse Jacobian", theta);
  // J_l^-1 = I - [phi]x / 2 + c [phi]x^2,  c = (1 - (theta/2) cot(theta/2)) / theta^2
  const double t = theta * theta;
  double c = 0.0;
  if (theta < kSeriesAngle) {
    c = 1.0 / 12 + t * (1.0 / 720 + t * (1.0 / 30240 + t * (1.0 / 1209600 + t / 47900160)));
  } else {
    c = (1.0 - 0.5 * theta * std::cos(theta / 2) / std::sin(theta / 2)) / t;
  }
  const Matrix3d phi_x = Skew(phi);
  return Matrix3d::Identity() - 0.5 * phi_x + c * phi_x * phi_x;
}

Matrix3d CalcLeftJacobianDot(const Vector3d& phi, const Vector3d& phi_dot) {
  // d/dt J_l = a [phi_dot]x + b ([phi_dot]x [phi]x + [phi]x [phi_dot]x) + a_dot [phi]x + b_dot [phi]x^2,
  // a_dot = (a'/theta) phi^T phi_dot, b_dot = (b'/theta) phi^T phi_dot.
  const JacobianCoefficients k = CalcJacobianCoefficients(phi.norm());
  const Matrix3d phi_x = Skew(phi);
  const Matrix3d phi_dot_x = Skew(phi_dot);
  const double theta_theta_dot = phi.dot(phi_dot);
  return k.a * phi_dot_x + k.b * (phi_dot_x * phi_x + phi_x * phi_dot_x) +
         theta_theta_dot * (k.a1 * phi_x + k.b1 * phi_x * phi_x);
}

OrientationError CalcOrientationError(const Matrix3d& R_Bo, const Vector3d& omega_o, const Matrix3d& R_Bd,
                                      const Vector3d& omega_d) {
  RequireRotation(R_Bo, "R_Bo");
  RequireRotation(R_Bd, "R_Bd");
  OrientationError error;
  error.R_od = R_Bo.transpose() * R_Bd;
  error.e_R = LogSo3(error.R_od);
  error.omega_od = error.R_od * omega_d - omega_o;
  error.e_R_dot = CalcLeftJacobianInverse(error.e_R) * error.omega_od;
  return error;
}

Vector3d CalcAngularAcceleration(const OrientationError& error, const Vector3d& omega_d,
                                 const Vector3d& omega_d_dot, const Vector3d& e_R_ddot) {
  // omega_od = J_l e_R_dot  =>  d/dt omega_od = J_l e_R_ddot + J_l_dot e_R_dot, and with R_od_dot =
  // [omega_od]x R_od d/dt omega_od = R_od omega_d_dot + omega_od x (R_od omega_d) - omega_o_dot.
  const Vector3d omega_od_dot =
      CalcLeftJacobian(error.e_R) * e_R_ddot + CalcLeftJacobianDot(error.e_R, error.e_R_dot) * error.e_R_dot;
  const Vector3d omega_d_o = error.R_od * omega_d;
  return error.R_od * omega_d_dot + error.omega_od.cross(omega_d_o) - omega_od_dot;
}

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
