#pragma once

// One constraint of the engine's documented soft law: its softness, and the rows whose forces share a cone.
// Members called error are bounds in units of the relative error of one operation.

#include <mujoco/mujoco.h>

#include <array>

#include "controller/common/types.h"

namespace dexcheck {

inline constexpr double kSumErrors = 8.0;  // of a sum of a few products, on both sides
constexpr double Squared(double x) { return x * x; }

/// The columns J qacc and J qvel of a point, [linear; angular] each, in the world.
struct PointMotion {
  Eigen::Matrix<double, 6, 2> value = Eigen::Matrix<double, 6, 2>::Zero();
  Eigen::Array22d error = Eigen::Array22d::Zero();  ///< Errors of the linear and the angular part.
};

/// Inverse inertia of the bodies that a constraint joins, 1/kg or 1/(kg m^2).
struct InverseInertia {
  double value = 0.0;
  double error = 0.0;  ///< Relative.
};

/// Stiffness K and damping B of the reference acceleration -B v - K d r, and the impedance d.
struct Softness {
  double K = 0.0, B = 0.0, d = 0.0;
  double d_error = 0.0;
};

/// Returns a constraint's softness at the distance r, less its margin. @param solref, solimp the engine's.
Softness CalcSoftness(const mjOption& option, const mjtNum* solref, const mjtNum* solimp, double r,
                      double r_error);

/// Rows whose forces share a cone, at most those of a contact: y = J qacc + B J qvel + K d r, and R.
struct SoftCone {
  size_t size = 0;
  std::array<double, 6> y{}, y_error{}, R{};
  double R_error = 0.0;  ///< Relative.

  /// w (1 - d) / d. Sets R_error.
  double CalcR(const Softness& soft, const InverseInertia& w);
  /// Adds a row without its R. @param along its direction, linear and angular.
  void Add(const Softness& soft, const PointMotion& motion, const Vector6d& along, double along_error,
           double r, double r_error);
  /// -y / R.
  [[nodiscard]] std::array<double, 6> CalcFreeForces() const;
  /// Returns the rounding error of a row's force. A projection moves two points no farther apart, in its
  /// metric.
  [[nodiscard]] double CalcForceError(size_t row, double force) const;
};

}  // namespace dexcheck
