#pragma once

// How well a motion shows the numbers that forces follow from.

#include <vector>

#include "controller/dynamics/tree_factor.h"
#include "harness/checks/step_record.h"

namespace dexcheck {

/// One instant of a motion.
struct MotionSample {
  VectorXd q;                ///< q' (p'), rad and m.
  VectorXd xi, xi_dot;       ///< (n), per s and per s^2.
  RowMatrixXd half_inverse;  ///< L^-T of M_bar' = L^T L over |C_bar' xi + F_bar'|_M^-1 (n x n).
};

/// That of a step. @param factor of the robot, scratch.
MotionSample TakeMotionSample(const StepRecord& step, TreeFactor* factor);

/// Singular values, the largest first, of the regressor W of (48) along a motion:
///
///   W e = L^-T (M_bar' xi_dot + C_bar' xi + F_bar') of the numbers p_k (1 + e_k), less that of p, to first
///   order, relative to |C_bar' xi + F_bar'|_M^-1 and rms over the samples,
///
/// with a column for each mass, centre of mass, inertia, armature, damping and gravity of the robot. So a
/// combination of relative errors e of length 1 leaves as much of the forces balanced as its singular value;
/// those of zero are combinations that no force shows. The values are exact to some 1e-8 of the largest.
VectorXd CalcSingularValues(const RobotSpec& robot, const std::vector<MotionSample>& samples);

/// Singular values of any regressor, the largest first.
VectorXd CalcSingularValues(const MatrixXd& W);

/// How many of them are above a floor.
int CountAbove(const VectorXd& singular_values, double floor);

}  // namespace dexcheck
