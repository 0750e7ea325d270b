#pragma once

// The interior-point method behind GraspForceSolver. Internal to controller/grasp.
//
// In the coordinates x_i = (mu_i f_i3, f_i1, f_i2) each friction cone (21) is K = {x0 >= |(x1, x2)|}, and the
// problem is
//
//   minimise    sum_i w_i x_i0
//   subject to  sum_i A_i x_i = b = F_o                             (multipliers y)
//               x_i in K,  lower_i <= x_i0 <= upper_i
//
// With s_i in K and z >= 0 the multipliers of cones and bounds, the point of the central path for rho solves,
// e = (1, 0, 0),
//
//   A_i^T y + s_i + (z_lower - z_upper)_i e = w_i e,     x_i o s_i = 2 rho e,
//   slack z = rho for every bound,
//
// and is the optimum of the barrier objective with weight rho. The Newton step on these equations is taken in
// Nesterov and Todd's scaling W s = W^-1 x [NT]; a 6 x 6 system is left to factor. Far from the target, steps
// are corrected to second order [M]. Because the bounds make the set of contact forces compact, a problem
// without solution drives y to a proof of that.
//
// [NT] Y. Nesterov, M. Todd: Primal-dual interior-point methods for self-scaled cones, 1998.
// [M] S. Mehrotra: On the implementation of a primal-dual interior point method, 1992.

#include <Eigen/Cholesky>
#include <vector>

#include "controller/common/types.h"
#include "controller/grasp/grasp_force.h"

namespace dexcheck::grasp_internal {

/// One contact: its part of the problem, of the iterate and of the search direction, in the coordinates x.
///
/// W is the Nesterov-Todd scaling: symmetric, with W s = W^-1 x = lambda. With d the curvature of the bounds
/// on x0, the Newton equations of one contact are (I + d u u^T) dx_scaled = aim + pull u + W (A^T dy -
/// dual_residual) and ds_scaled = aim - dx_scaled, with u = W e and dx = W dx_scaled. R = (I + d u
/// u^T)^(-1/2). Pairs are of the lower and the upper bound.
class InteriorPointContact {
 public:
  // The problem.
  double w = 0.0;                 ///< Cost of x0, 1 / mu.
  Eigen::Array2d limits;          ///< Of x0.
  Eigen::Matrix<double, 6, 3> A;  ///< Columns of the equality constraints.

  // The iterate.
  Vector3d x, s;
  Eigen::Array2d slack, z;  ///< Distances of x0 from its limits, and their multipliers.
  Vector3d dual_residual;   ///< w e - A^T y - s - (z_lower - z_upper) e

  // The scaling and the direction.
  Eigen::Matrix<double, 6, 3> M;  ///< A W R
  Vector3d h;                     ///< R^-1 dx_scaled for dy = 0.

  /// Sets the cone's axis at the middle of the limits, with multipliers that satisfy the dual equation for
  /// y = 0: x o s = 2 target e, slack_lower z_lower = target, and slack_upper z_upper >= target if 4 target
  /// >= w (lower + upper).
  void SetCenter(double target);
  /// Computes the slacks from x and the limits.
  void MeasureSlack();
  /// Computes W, R and M at the present iterate.
  void CalcScaling();
  /// Aims the Newton step at x o s = 2 target e and slack z = target; with `corrected`, less the second-order
  /// error of the direction last set [M].
  void Aim(double target, bool corrected);
  /// Computes h.
  void CalcFreeDirection();
  /// Sets the direction for dy; returns the inverse of the longest step that stays inside.
  double SetDirection(const Vector6d& dy);
  /// Takes `step` of the direction for dy.
  void Advance(double step, const Vector6d& dy);
  /// Part of the contact, at most, in the distance of the barrier objective from its optimum.
  [[nodiscard]] double CalcBarrierGap(double rho) const;
  /// Largest (A^T y)^T x over {x in K, lower <= x0 <= upper}.
  [[nodiscard]] double CalcSupport(const Vector6d& y) const;

 private:
  Eigen::Matrix3d W_, K_;  // K = W R
  Vector3d u_;             // W e
  double r_ = 0.0;         // R = I + r u u^T
  Vector3d lambda_;
  Vector3d aim_;  // dx_scaled + ds_scaled
  Eigen::Array2d z_aim_;
  Vector3d dx_, dx_scaled_, ds_scaled_;
  Eigen::Array2d dz_;
};

/// Solves problems with one number of contacts. Allocates in its constructor alone.
class InteriorPointKernel {
 public:
  explicit InteriorPointKernel(int num_contacts) : contacts_(static_cast<std::size_t>(num_contacts)) {}
  /// Solves a valid problem of the right size into `result`, whose vectors have the right size.
  void Solve(const GraspForceProblem& problem, const GraspForceOptions& options, GraspForceResult& result);
  /// Forgets the last solution.
  void Reset() { has_last_ = false; }

 private:
  void Load(const GraspForceProblem& problem);
  void StartCold(double barrier_weight);
  bool StartWarm();
  GraspForceStatus Iterate(const Matrix6Xd& G, const GraspForceOptions& options, bool warm, int& iterations);
  void CalcResiduals();
  [[nodiscard]] double CalcGap(double rho) const;
  [[nodiscard]] bool ProvesInfeasibility() const;
  void Factor();
  [[nodiscard]] double CalcScaledDeterminant() const;
  double CalcDirection();
  void Report(const GraspForceProblem& problem, const GraspForceOptions& options,
              GraspForceResult& result) const;

  std::vector<InteriorPointContact> contacts_;
  Vector6d b_, y_, dy_, residual_;
  Vector6d diagonal_;                                   // of sum_i M_i M_i^T
  Eigen::LDLT<Eigen::Matrix<double, 6, 6>> equations_;  // the same, factored
  double gap_ = 0.0, objective_ = 0.0, max_dual_residual_ = 0.0;
  bool has_last_ = false;
};

}  // namespace dexcheck::grasp_internal
