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

#include <array>
#include <vector>

#include "controller/grasp/contact_pack.h"
#include "controller/grasp/grasp_force.h"

namespace dexcheck::grasp_internal {

inline constexpr std::size_t kRows = 6;  // of the equality constraints
using RowVector = std::array<double, kRows>;

/// S dy = b with S (6 x 6) symmetric positive definite, factored in place as L D L^T.
class NormalEquations {
 public:
  /// Entry of the lower triangle, col <= row.
  double& operator()(std::size_t row, std::size_t col) { return S_[row * kRows + col]; }
  void SetZero() { S_.fill(0.0); }
  /// Replaces S by its factors.
  void Factor();
  /// Determinant of S after scaling it to a unit diagonal: one for rows of the constraint matrix at right
  /// angles, zero for dependent ones. Not finite if a pivot vanished.
  [[nodiscard]] double CalcScaledDeterminant() const;
  /// Replaces b by S^-1 b.
  void Solve(RowVector& b);

 private:
  std::array<double, kRows * kRows> S_{};
  RowVector diagonal_{}, inv_pivots_{};
};

/// Solves problems with one number of contacts, in packs of four. Allocates in its constructor alone.
class InteriorPointKernel {
 public:
  explicit InteriorPointKernel(int num_contacts);
  /// Solves a valid problem of the right size into `result`, whose vectors have the right size.
  void Solve(const GraspForceProblem& problem, const GraspForceOptions& options, GraspForceResult& result);
  /// Forgets the last solution.
  void Reset() { has_last_ = false; }

 private:
  struct Pack : ContactPack {
    std::array<Lanes3, kRows> A, M;  // the rows of A_i and of M_i = A_i W_i R_i
    Lanes3 h;                        // R_i^-1 dx_scaled for dy = 0
  };

  /// The barrier's parameter: two for each cone, two for each pair of bounds.
  [[nodiscard]] double CalcDegree() const { return static_cast<double>(4 * kLanes * packs_.size()); }
  void Load(const GraspForceProblem& problem);
  void StartCold(double barrier_weight);
  bool StartWarm();
  GraspForceStatus Iterate(const Matrix6Xd& G, const GraspForceOptions& options, bool warm, int& iterations);
  void CalcResiduals();
  [[nodiscard]] double CalcSeparation() const;
  [[nodiscard]] double CalcGap(double rho) const;
  [[nodiscard]] bool ProvesInfeasibility() const;
  void Factor();
  double CalcDirection();
  void Advance(double step);
  void Report(const GraspForceProblem& problem, const GraspForceOptions& options,
              GraspForceResult& result) const;

  std::vector<Pack> packs_;
  RowVector b_{}, y_{}, dy_{}, residual_{};
  NormalEquations equations_;
  double gap_ = 0.0, objective_ = 0.0, max_residual_ = 0.0, max_dual_residual_ = 0.0;
  bool has_last_ = false;
};

}  // namespace dexcheck::grasp_internal
