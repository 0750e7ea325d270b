#include "controller/model/rigid_body.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

#include "controller/common/text.h"

namespace dexcheck {

namespace {

Matrix3d Diagonal(double Ixx, double Iyy, double Izz) { return Vector3d(Ixx, Iyy, Izz).asDiagonal(); }

Matrix3d CalcInertia(const SolidSphere& sphere, double m) {
  // I = 2/5 m r^2
  return Matrix3d::Identity() * (0.4 * m * sphere.radius * sphere.radius);
}

Matrix3d CalcInertia(const SolidCylinder& cylinder, double m) {
  // I_x = m (r^2 / 4 + l^2 / 12),  I_z = m r^2 / 2
  const double r = cylinder.radius;
  const double l = cylinder.length;
  const double Ix = m * (r * r / 4.0 + l * l / 12.0);
  return Diagonal(Ix, Ix, m * r * r / 2.0);
}

Matrix3d CalcInertia(const SolidCapsule& capsule, double m) {
  // A cylinder and two half spheres share the mass as l : 4/3 r. Each half sphere, of mass m_s / 2, has its
  // centre of mass 3/8 r beyond the cylinder's end, so by the parallel-axis theorem
  //   I_x = m_c (r^2 / 4 + l^2 / 12) + m_s (2/5 r^2 + l^2 / 4 + 3/8 l r),  I_z = m_c r^2 / 2 + m_s 2/5 r^2
  const double r = capsule.radius;
  const double l = capsule.length;
  const double m_c = m * l / (l + 4.0 / 3.0 * r);
  const double m_s = m - m_c;
  const double Ix = m_c * (r * r / 4.0 + l * l / 12.0) + m_s * (0.4 * r * r + l * l / 4.0 + 0.375 * l * r);
  return Diagonal(Ix, Ix, (0.5 * m_c + 0.4 * m_s) * r * r);
}

Matrix3d CalcInertia(const SolidBox& box, double m) {
  // I_x = m (s_y^2 + s_z^2) / 12 and cyclic
  const Vector3d s2 = box.size.array().square();
  return Diagonal(s2.y() + s2.z(), s2.z() + s2.x(), s2.x() + s2.y()) * (m / 12.0);
}

Matrix3d CalcInertia(const SolidTorus& torus, double m) {
  // I_x = m (R^2 / 2 + 5/8 r^2),  I_z = m (R^2 + 3/4 r^2)
  const double R = torus.ring_radius;
  const double r = torus.tube_radius;
  const double Ix = m * (0.5 * R * R + 0.625 * r * r);
  return Diagonal(Ix, Ix, m * (R * R + 0.75 * r * r));
}

Matrix3d CalcInertia(const SolidEllipsoid& ellipsoid, double m) {
  // I_x = m (b^2 + c^2) / 5 and cyclic
  const Vector3d a2 = ellipsoid.semi_axes.array().square();
  return Diagonal(a2.y() + a2.z(), a2.z() + a2.x(), a2.x() + a2.y()) * (m / 5.0);
}

/// Rods and plates meet the inequalities with equality. Their entries, rounded when written down, rotated and
/// summed (some ten roundings each), and the eigenvalues computed from them are off by a few eps |I|. An
/// inertia that was moved to the centre of mass is a difference of terms of the size m |c|^2.
double CalcAllowance(const MassProperties& body) {
  const double size = body.inertia.cwiseAbs().maxCoeff() + body.mass * body.com.squaredNorm();
  return 64.0 * std::numeric_limits<double>::epsilon() * size;
}

/// Ascending.
Vector3d CalcPrincipalMoments(const Matrix3d& inertia) {
  return Eigen::SelfAdjointEigenSolver<Matrix3d>(inertia, Eigen::EigenvaluesOnly).eigenvalues();
}

}  // namespace

Matrix3d ToTensor(const Vector6d& I) {
  return Matrix3d{{I[0], I[3], I[4]}, {I[3], I[1], I[5]}, {I[4], I[5], I[2]}};
}

Vector6d ToEntries(const Matrix3d& I) {
  return Vector6d{{I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)}};
}

Matrix3d TurnRollPitchYaw(const Vector3d& angles) {
  return (Eigen::AngleAxisd(angles[2], Vector3d::UnitZ()) * Eigen::AngleAxisd(angles[1], Vector3d::UnitY()) *
          Eigen::AngleAxisd(angles[0], Vector3d::UnitX()))
      .toRotationMatrix();
}

Matrix3d CalcUniformInertia(const Shape& shape, double mass) {
  return std::visit([mass](const auto& solid) { return CalcInertia(solid, mass); }, shape);
}

MassProperties CalcMassProperties(const Shape& shape, double mass, const Pose& X_BS) {
  // I_B = R_BS I_S R_BS^T
  const Matrix3d R_BS = X_BS.linear();
  return {mass, X_BS.translation(), R_BS * CalcUniformInertia(shape, mass) * R_BS.transpose()};
}

Matrix3d CalcPointInertia(double mass, const Vector3d& c) {
  return mass * (c.squaredNorm() * Matrix3d::Identity() - c * c.transpose());
}

MassProperties Combine(const std::vector<MassProperties>& parts) {
  MassProperties whole;
  for (const MassProperties& part : parts) {
    whole.mass += part.mass;
    whole.com += part.mass * part.com;
  }
  if (whole.mass > 0.0) whole.com /= whole.mass;
  // I = sum I_i - m_i [d_i]x [d_i]x,  d_i = com_i - com
  for (const MassProperties& part : parts) {
    const Matrix3d d = Skew(part.com - whole.com);
    whole.inertia += part.inertia - part.mass * d * d;
  }
  return whole;
}

std::string FindPhysicalInconsistency(const MassProperties& body) {
  std::string problem = FindUndefinedDynamics(body);
  if (!problem.empty()) return problem;
  const Vector3d moments = CalcPrincipalMoments(body.inertia);
  if (moments[0] + moments[1] < moments[2] - CalcAllowance(body)) {
    return "principal moments of inertia must satisfy the triangle inequality, got " + FormatNumbers(moments);
  }
  return {};
}

std::string FindUndefinedDynamics(const MassProperties& body) {
  if (!std::isfinite(body.mass) || body.mass < 0.0) {
    return "mass must be finite and not negative, got " + FormatNumber(body.mass);
  }
  if (!body.com.allFinite()) {
    return "centre of mass must be finite, got " + FormatNumbers(body.com);
  }
  if (!body.inertia.allFinite()) {
    return "inertia must be finite, got " + FormatNumbers(body.inertia.reshaped<Eigen::RowMajor>());
  }
  if (body.mass == 0.0 && !body.inertia.isZero(0.0)) {
    return "a massless body has no inertia, got " + FormatNumbers(body.inertia.diagonal());
  }

  const double allowance = CalcAllowance(body);
  if ((body.inertia - body.inertia.transpose()).cwiseAbs().maxCoeff() > allowance) {
    return "inertia must be symmetric, got " + FormatNumbers(body.inertia.reshaped<Eigen::RowMajor>());
  }
  const Vector3d moments = CalcPrincipalMoments(body.inertia);
  if (moments[0] < -allowance) {
    return "principal moments of inertia must not be negative, got " + FormatNumbers(moments);
  }
  return {};
}

MassProperties ExpressIn(const MassProperties& body, const Pose& X_AB) {
  // I_A = R_AB I_B R_AB^T
  const Matrix3d R_AB = X_AB.linear();
  return {body.mass, X_AB * body.com, R_AB * body.inertia * R_AB.transpose()};
}

Matrix3d MakeRotationFromZ(const Vector3d& z) {
  int least = 0;
  z.cwiseAbs().minCoeff(&least);
  const Vector3d x = Vector3d::Unit(least).cross(z).normalized();
  Matrix3d R;
  R << x, z.cross(x), z;
  return R;
}

}  // namespace dexcheck
