#pragma once

// Change of frame for twists V = [v; omega] and wrenches F = [f; tau], both 6x1 and linear part first.

#include "controller/common/types.h"

namespace dexcheck {

/// Adjoint Ad_g of g_ab (6x6): V_a = Ad_g V_b takes a twist from frame b to frame a (used by (22), (30)).
inline Matrix6d CalcAdjoint(const Pose& g_ab) {
  // Ad_g = [R  [p]x R; 0  R]
  const Matrix3d R = g_ab.linear();
  Matrix6d Ad;
  Ad << R, Skew(g_ab.translation()) * R, Matrix3d::Zero(), R;
  return Ad;
}

/// Adjoint of the inverse, Ad_{g^-1} = Ad_g^-1 of g_ab (6x6): takes a twist from frame a to frame b.
inline Matrix6d CalcAdjointInverse(const Pose& g_ab) {
  // Ad_g^-1 = [R^T  -R^T [p]x; 0  R^T]
  const Matrix3d R_transposed = g_ab.linear().transpose();
  Matrix6d Ad;
  Ad << R_transposed, -R_transposed * Skew(g_ab.translation()), Matrix3d::Zero(), R_transposed;
  return Ad;
}

/// Wrench transform Ad_g^-T of g_ab (6x6), (22): F_a = Ad_g^-T F_b takes a wrench from frame b to frame a.
inline Matrix6d CalcWrenchTransform(const Pose& g_ab) { return CalcAdjointInverse(g_ab).transpose(); }

/// Lie bracket matrix ad_V of a twist V = [v; omega] (6x6): with V the body twist of g,
/// d/dt Ad_g = Ad_g ad_V and d/dt Ad_g^-1 = -ad_V Ad_g^-1.
inline Matrix6d CalcTwistCross(const Vector6d& V) {
  // ad_V = [[omega]x  [v]x; 0  [omega]x]
  const Matrix3d omega_cross = Skew(V.tail<3>());
  Matrix6d ad;
  ad << omega_cross, Skew(V.head<3>()), Matrix3d::Zero(), omega_cross;
  return ad;
}

}  // namespace dexcheck
