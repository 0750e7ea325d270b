#pragma once

// Random grasps of a torus, for tests and benchmarks.

#include <random>

#include "controller/common/types.h"
#include "controller/grasp/grasp_force.h"

namespace dexcheck::testing {

inline constexpr double kTorusRadius = 0.035;  // of the centre circle, m
inline constexpr double kTubeRadius = 0.011;   // m

/// Grasp map columns (23) of a hard-finger contact (20) with pose X_OC in the object frame: [R; [p]x R].
Eigen::Matrix<double, 6, 3> CalcContactColumns(const Pose& X_OC);

/// Contact frame on the torus around z, at angle `around` on the centre circle and `tube` on the tube (0
/// outside, pi inside), z into the torus, turned by `spin` about z; rad.
Pose CalcTorusContact(double around, double tube, double spin);

/// N contacts anywhere on the torus, one mu in [0.2, 1] for all, a force up to 20 N and a moment up to 1 N m
/// in any direction, normal forces in [0.2, 100] N.
GraspForceProblem MakeRandomGraspForceProblem(std::mt19937_64& random, int num_contacts);

/// N contacts evenly spaced on the torus's outer equator, spin 0: tangential x along the equator, y along -z
/// of the object.
GraspForceProblem MakeEquatorGraspForceProblem(int num_contacts, double mu);

/// N contacts with random frames on one line, evenly spaced over 0.1 m and shaken, whose middle is `offset` m
/// from the object frame's origin; lengths and moments times `unit`. G has rank 5: no force gives `n`, the
/// moment about the line, as a functional on [force; moment].
struct LineGrasp {
  GraspForceProblem problem;
  Vector6d n;
};
LineGrasp MakeRandomLineGrasp(std::mt19937_64& random, int num_contacts, double offset, double unit);

/// y^T F_o less the largest y^T G f of admissible forces f, contact by contact: a linear function over a
/// truncated cone is largest at a normal force at one of its bounds and a tangential force at the cone's
/// edge, along the function's own. Positive: no admissible forces give F_o.
double CalcSeparation(const GraspForceProblem& problem, const Vector6d& y);

/// One millisecond of motion: the wrench changes by about 5 mN and 0.2 mN m, contacts roll by about 0.5 mrad.
void MoveGrasp(std::mt19937_64& random, GraspForceProblem& problem);

}  // namespace dexcheck::testing
