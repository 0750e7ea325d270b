#pragma once

// The interior-point method behind GraspForceSolver. Internal to controller/grasp.
//
// In the coordinates x_i = (mu_i f_i3, f_i1, f_i2) each friction cone (21) is K = {x0 >= |(x1, x2)|}, and the
// problem is
//
//   minimise    sum_i w_i x_i0
//   subject to  sum_i A_i x_i - [0; t] = b = [F_o; 0]                             (multipliers y)
//               x_i in K,  lower_i <= x_i0 <= upper_i,  lower_j <= t_j <= upper_j
//
// with one t_j for each limited function of the contact forces. With s_i in K and z >= 0 the multipliers of
// cones and bounds, the point of the central path for rho solves, e = (1, 0, 0),
//
//   A_i^T y + s_i + (z_lower - z_upper)_i e = w_i e,     y_j = (z_lower - z_upper)_j,
//   x_i o s_i = 2 rho e,                                 slack z = rho for every bound.
//
// It is the optimum of the barrier objective with weight rho, and tends to that of the linear objective as
// rho tends to 0. The Newton step on these equations is taken in Nesterov and Todd's scaling W s = W^-1 x
// [NT]; a 6 x 6 system, larger with limits, is left to factor. Far from the target, steps are corrected to
// second order [M]. Because the bounds make the set of contact forces compact, every y gives a lower bound on
// the linear objective in closed form, and a problem without solution drives y to a proof of that.
//
// [NT] Y. Nesterov, M. Todd: Primal-dual interior-point methods for self-scaled cones, 1998.
// [M] S. Mehrotra: On the implementation of a primal-dual interior point method, 1992.

#include <cstddef>
#include <vector>

#include "controller/grasp/box_bounds.h"
#include "controller/grasp/contact_pack.h"
#include "controller/grasp/grasp_force_kernel.h"
#include "controller/grasp/lanes.h"
#include "controller/grasp/normal_equations.h"

namespace dexcheck::grasp_internal {

/// kPacks packs of four contacts and kRows = 6 + M equality rows, both known at compile time or both
/// kAnySize.
template <int kPacks, int kRows>
class InteriorPointKernel final : public GraspForceKernel {
 public:
  InteriorPointKernel(int num_contacts, int num_limits);
  void Solve(const GraspForceProblem& problem, const GraspForceOptions& options,
             GraspForceResult& result) override;
  void Reset() override { has_last_ = false; }

 private:
  static constexpr int kEntries = kPacks == kAnySize ? kAnySize : kPacks * kRows;

  std::size_t num_packs() const { return packs_.size(); }
  std::size_t num_rows() const { return y_.size(); }
  std::size_t num_limits() const { return limits_.size(); }
  /// The barrier's parameter: two for each cone, two for each pair of bounds.
  double CalcDegree() const { return static_cast<double>(4 * kLanes * num_packs() + 2 * num_limits()); }
  const Lanes3& A(std::size_t pack, std::size_t row) const { return A_[pack * num_rows() + row]; }
  const Lanes3& M(std::size_t pack, std::size_t row) const { return M_[pack * num_rows() + row]; }
  /// g += factor rows^T y, for the rows of one pack.
  void AddCombination(const Lanes3* rows, const Buffer<double, kRows>& y, double factor, Lanes3& g) const {
    for (std::size_t k = 0; k < num_rows(); ++k) {
      for (std::size_t j = 0; j < 3; ++j) g[j] += rows[k][j] * (factor * y[k]);
    }
  }

  void Load(const GraspForceProblem& problem);
  void StartCold(double barrier_weight);
  bool StartWarm();
  void Save();
  void Restore();
  GraspForceStatus Iterate(const Matrix6Xd& G, const GraspForceOptions& options, bool warm, int& iterations);
  void CalcResiduals();
  double CalcBound(bool with_cost) const;
  double CalcGap(const GraspForceOptions& options) const;
  bool ProvesInfeasibility() const;
  void Factor();
  void Aim(double target);
  void AimCorrected(double target);
  double CalcDirection();
  void Advance(double step);
  bool RestoreFeasibility();
  void Report(const GraspForceProblem& problem, const GraspForceOptions& options,
              GraspForceResult& result) const;

  Buffer<ContactPack, kPacks> packs_;
  Buffer<Lanes3, kEntries> A_, M_;  // the rows of A_i and of M_i = A_i W_i R_i
  Buffer<Lanes3, kPacks> h_;        // R_i^-1 dx_scaled for dy = 0
  Buffer<double, kRows> b_, y_, dy_, saved_y_, residual_;
  NormalEquations<kRows> equations_;

  // A limited linear function t of the contact forces.
  struct Limit {
    double lower, upper;
    double t;
    BoxBounds<double> bounds;
    double dual_residual, dt;
    // dt for dy = 0.
    double CalcFreeStep() const { return (bounds.CalcPull() - dual_residual) / bounds.curvature(); }
  };
  std::vector<Limit> limits_, saved_limits_;

  double gap_ = 0.0, objective_ = 0.0, max_residual_ = 0.0, max_dual_residual_ = 0.0;
  bool has_last_ = false;
};

}  // namespace dexcheck::grasp_internal
