#pragma once

#include <mujoco/mujoco.h>

#include <vector>

#include "controller/dynamics/term_types.h"
#include "harness/engine/adapter.h"

namespace dexcheck {

/// T(q') between the paper's velocities and the engine's: qvel = T velocity, qacc = T velocity_dot + T_dot
/// velocity, for an upright base on rolling wheels. The wheels' rolling follows from the engine's own
/// geometry. For a floating base T is the identity: both have the origin's velocity along the world's axes
/// and the angular velocity along the base's. T has dense columns for the base, unit entries for joints.
class VelocityMap {
 public:
  VelocityMap(const Adapter& adapter, Coordinates coordinates);

  /// Evaluates T and T_dot velocity at q' and xi (reduced) or q_dot' (unreduced).
  /// @param tilt turns the upright base to where the engine has it.
  void SetState(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& velocity,
                const Matrix3d& tilt = Matrix3d::Identity());

  /// Number of velocity coordinates.
  [[nodiscard]] int size() const { return base_size_ + static_cast<int>(adapter_->joint_dofs().size()); }

  /// The engine's dofs of the base's joints, then of the wheels.
  [[nodiscard]] const std::vector<int>& base_dofs() const { return base_dofs_; }
  /// Rows of T for those dofs in the base's columns; they are zero in the other columns.
  [[nodiscard]] const MatrixXd& base_columns() const { return T_base_; }

  /// Writes T velocity on the robot's dofs of an nv-vector; other dofs are left alone.
  void Expand(const Eigen::Ref<const VectorXd>& velocity, mjtNum* qvel) const;
  /// Writes T_dot velocity, at SetState's velocity, on the robot's dofs of an nv-vector.
  void ExpandBias(mjtNum* qacc) const;
  /// Writes T_dot(a) b - T_dot(b) a at q', T_dot(a) being T's rate at velocity a, on the robot's dofs of an
  /// nv-vector. It is zero where velocities are rates of coordinates; for reduced columns, which turn with
  /// the heading, it points sideways. The angular velocity of a floating base or of a ball joint is no rate
  /// of coordinates: T has there the bracket [0; omega_a x omega_b], or omega_a x omega_b.
  void ExpandBracket(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& a,
                     const Eigen::Ref<const VectorXd>& b, mjtNum* qacc);
  /// result = T^T force.
  void ProjectForce(const mjtNum* force, Eigen::Ref<VectorXd> result) const;

 private:
  /// Velocity (or acceleration) of Sigma_0's origin in the world, and that about the vertical.
  struct BaseMotion {
    Vector3d linear = Vector3d::Zero();
    double yaw = 0.0;
  };
  [[nodiscard]] BaseMotion CalcColumnMotion(int column, const Vector3d& heading) const;
  [[nodiscard]] BaseMotion CalcBaseMotion(const Eigen::Ref<const VectorXd>& velocity,
                                          const Vector3d& heading) const;
  void FillRates(const Vector3d& anchor_velocity, double yaw, double forward,
                 Eigen::Ref<VectorXd> rates) const;

  const Adapter* adapter_;
  bool is_floating_;
  int base_size_;
  std::vector<int> base_dofs_;
  MatrixXd T_base_;   // base_dofs x base_size
  VectorXd bias_;     // T_dot velocity on base_dofs
  VectorXd bracket_;  // scratch of ExpandBracket
};

}  // namespace dexcheck
