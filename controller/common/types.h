#pragma once

// Fixed-size aliases and unit helpers that the whole project shares.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <numbers>

namespace dexcheck {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

using Matrix2d = Eigen::Matrix2d;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix3Xd = Eigen::Matrix<double, 3, Eigen::Dynamic>;
using Matrix6Xd = Eigen::Matrix<double, 6, Eigen::Dynamic>;
using RowMatrixXd = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// Rigid transform; X_AB maps coordinates in frame B to coordinates in frame A.
using Pose = Eigen::Isometry3d;

inline constexpr double kPi = std::numbers::pi;

constexpr double DegToRad(double degrees) { return degrees * (kPi / 180.0); }
constexpr double RadToDeg(double radians) { return radians * (180.0 / kPi); }

/// Cross-product matrix [p]x, so that Skew(p) * v = p x v.
inline Matrix3d Skew(const Vector3d& p) {
  Matrix3d S;
  S << 0.0, -p.z(), p.y(), p.z(), 0.0, -p.x(), -p.y(), p.x(), 0.0;
  return S;
}

}  // namespace dexcheck
