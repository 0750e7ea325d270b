#pragma once

// q_dot' = S' xi and its derivative for a whole robot, built on the platform's S_v.

#include "controller/model/platform.h"
#include "controller/model/robot_model.h"

namespace dexcheck::testing {

/// S' = diag(S_v, 1) with shape p' x (p' - r), A = [A_v, 0] with r rows. A base without constraint has S'
/// = 1.
struct ReductionMap {
  MatrixXd S;
  MatrixXd S_dot;
  MatrixXd A;
};

/// @param q q'; @param xi reduced velocities, which S_dot needs.
inline ReductionMap CalcReductionMap(const RobotModel& model, const VectorXd& q, const VectorXd& xi) {
  const int p = model.num_positions();
  const int n = model.num_velocities();
  ReductionMap map{MatrixXd::Identity(p, n), MatrixXd::Zero(p, n), MatrixXd::Zero(p - n, p)};
  if (model.base().type != BaseType::kDifferentialDrive) return map;
  const PlatformConstraint platform = CalcPlatformConstraint(model.base(), q.head<3>(), xi.head<2>());
  map.S.setZero();
  map.S.topLeftCorner<3, 2>() = platform.S_v;
  map.S.bottomRightCorner(n - 2, n - 2).setIdentity();
  map.S_dot.topLeftCorner<3, 2>() = platform.S_v_dot;
  map.A.leftCols<3>() = platform.A_v;
  return map;
}

}  // namespace dexcheck::testing
