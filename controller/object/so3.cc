#include "controller/object/so3.h"

#include <Eigen/LU>
#include <cmath>

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

}  // namespace dexcheck
