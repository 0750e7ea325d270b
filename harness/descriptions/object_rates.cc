#include <mujoco/mujoco.h>

#include "harness/descriptions/engine_provider.h"

namespace dexcheck {

ObjectRates CalcObjectRates(const Vector6d& X_o, const Vector6d& X_o_dot) {
  // Quaternion z(alpha) y(beta) z(gamma). Each angle's rate turns about its axis; the later rotations carry
  // that axis along, and move it: d/dt (S^T w) = S^T w_dot - rate axis x S^T w for S a turn about `axis`.
  const mjtNum axes[3][3] = {{0, 0, 1}, {0, 1, 0}, {0, 0, 1}};
  mjtNum rotation[4] = {1, 0, 0, 0};
  Matrix3d W = Matrix3d::Zero();      // columns: the axes of the three angles
  Vector3d omega = Vector3d::Zero();  // W times the rates
  Vector3d omega_dot = Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    mjtNum step[4];
    mjtNum inverse[4];
    mju_axisAngle2Quat(step, axes[k], X_o[3 + k]);
    mju_mulQuat(rotation, rotation, step);
    mju_negQuat(inverse, step);
    const auto turn = [&](const Vector3d& vector) {
      Vector3d turned;
      mju_rotVecQuat(turned.data(), vector.data(), inverse);
      return turned;
    };
    const Vector3d axis(axes[k][0], axes[k][1], axes[k][2]);
    for (int col = 0; col < k; ++col) W.col(col) = turn(W.col(col));
    W.col(k) = axis;
    omega = turn(omega);
    omega_dot = turn(omega_dot) - X_o_dot[3 + k] * axis.cross(omega);
    omega += X_o_dot[3 + k] * axis;
  }
  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> R;
  mju_quat2Mat(R.data(), rotation);
  ObjectRates rates;
  rates.P_inv.topLeftCorner<3, 3>() = R.transpose();
  rates.P_inv.bottomRightCorner<3, 3>() = W;
  const Vector3d v = R.transpose() * X_o_dot.head<3>();
  rates.bias << -omega.cross(v), omega_dot;
  // Of pose and velocity rounding is taken out of the quaternion first.
  mju_normalize4(rotation);
  mju_quat2Mat(R.data(), rotation);
  rates.X_Bo.linear() = R;
  rates.X_Bo.translation() = X_o.head<3>();
  rates.V_Bo << R.transpose() * X_o_dot.head<3>(), omega;
  return rates;
}

}  // namespace dexcheck
