#include "controller/model/rigid_body.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

#include "controller/common/text.h"

namespace dexcheck {

namespace {

// Squares of the coordinates of a uniform solid's points along x, y and z, their mean, m^2: per mass,
// I_x = s_y + s_z and cyclic.

Vector3d CalcMeanSquares(const SolidEllipsoid& ellipsoid) {
  return ellipsoid.semi_axes.array().square() / 5.0;
}

Vector3d CalcMeanSquares(const SolidSphere& sphere) {
  return Vector3d::Constant(sphere.radius * sphere.radius / 5.0);
}

Vector3d CalcMeanSquares(const SolidBox& box) { return box.size.array().square() / 12.0; }

Vector3d CalcMeanSquares(const SolidCylinder& cylinder) {
  const double r2 = cylinder.radius * cylinder.radius;
  return {r2 / 4.0, r2 / 4.0, cylinder.length * cylinder.length / 12.0};
}

Vector3d CalcMeanSquares(const SolidCapsule& capsule) {
  // A cylinder and two half spheres share the mass as l : 4/3 r. Each half sphere has its centre of mass
  // 3/8 r beyond the cylinder's end.
  const double r = capsule.radius;
  const double l = capsule.length;
  const double part = l / (l + 4.0 / 3.0 * r);
  const Vector3d ends(r * r / 5.0, r * r / 5.0, r * r / 5.0 + l * l / 4.0 + 0.375 * l * r);
  return part * CalcMeanSquares(SolidCylinder{r, l}) + (1.0 - part) * ends;
}

Vector3d CalcMeanSquares(const SolidTorus& torus) {
  const double R2 = torus.ring_radius * torus.ring_radius;
  const double r2 = torus.tube_radius * torus.tube_radius;
  return {0.5 * R2 + 0.375 * r2, 0.5 * R2 + 0.375 * r2, 0.25 * r2};
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
  const Vector3d s = std::visit([](const auto& solid) { return CalcMeanSquares(solid); }, shape);
  return (mass * Vector3d(s.y() + s.z(), s.z() + s.x(), s.x() + s.y())).asDiagonal();
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
