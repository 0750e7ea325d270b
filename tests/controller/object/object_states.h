#pragma once

// An object without symmetry, random states with a local seed, and a smooth motion, for the tests of
// section 3.3.

#include <cmath>
#include <random>
#include <vector>

#include "controller/common/types.h"
#include "controller/model/rigid_body.h"

namespace dexcheck::testing {

inline const Vector3d kGravity{0.3, -0.4, -9.81};  // Tilted, so that no component is tested against zero.

/// Axes of the test object's principal moments, as columns in Sigma_o.
inline Matrix3d PrincipalAxes() {
  return (Eigen::AngleAxisd(0.7, Vector3d::UnitX()) * Eigen::AngleAxisd(-0.4, Vector3d::UnitZ()))
      .toRotationMatrix();
}

inline const Vector3d kPrincipalMoments{0.7, 1.1, 1.5};  // kg m^2

/// 2 kg, three different principal moments, none of them along an axis of Sigma_o.
inline MassProperties MakeObject() {
  MassProperties object;
  object.mass = 2.0;
  object.inertia = PrincipalAxes() * kPrincipalMoments.asDiagonal() * PrincipalAxes().transpose();
  return object;
}

struct ObjectState {
  Vector6d X_o, X_o_dot, X_o_ddot;
};

/// States with |sin(beta)| >= 0.3, on every branch of the angles; rates and accelerations up to 1.
inline std::vector<ObjectState> MakeObjectStates(unsigned seed, int count) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> angle(-8.0, 8.0);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<ObjectState> states;
  while (states.size() < static_cast<size_t>(count)) {
    ObjectState state;
    for (int i = 0; i < 6; ++i) {
      state.X_o[i] = i < 3 ? unit(generator) : angle(generator);
      state.X_o_dot[i] = unit(generator);
      state.X_o_ddot[i] = unit(generator);
    }
    if (std::abs(std::sin(state.X_o[4])) >= 0.3) states.push_back(state);
  }
  return states;
}

/// The motion through `state` at t = 0 with constant X_o_ddot.
inline Vector6d MoveBy(const ObjectState& state, double t) {
  return state.X_o + t * state.X_o_dot + 0.5 * t * t * state.X_o_ddot;
}

/// Equation (8) by elementary rotations, independent of the library's own matrix.
inline Matrix3d RotationByEigen(const Vector6d& X_o) {
  return (Eigen::AngleAxisd(X_o[3], Vector3d::UnitZ()) * Eigen::AngleAxisd(X_o[4], Vector3d::UnitY()) *
          Eigen::AngleAxisd(X_o[5], Vector3d::UnitZ()))
      .toRotationMatrix();
}

}  // namespace dexcheck::testing
