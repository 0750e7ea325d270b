#pragma once

// Grasp-force optimisation: the internal force F_N of (27), (49) that keeps every contact force inside its
// friction cone (21), as the linear-matrix-inequality problem of references [23] and [24] of the paper.
//
// [23] L. Han, J. C. Trinkle, Z. X. Li: Grasp analysis as linear matrix inequality problems, 2000.
// [24] M. Buss, H. Hashimoto, J. B. Moore: Dextrous hand grasping force optimization, 1996.

#include <limits>
#include <memory>

#include "controller/common/types.h"

namespace dexcheck {

/// One grasp-force problem for N hard-finger contacts (20):
///
///   G f_c = F_o,   |(f_i1, f_i2)| <= mu_i f_i3,   f_min_i <= f_i3 <= f_max_i.
///
/// f_c (3N) stacks the forces of finger on object in the contact frames, z into the object, so that f_i3 >= 0
/// pushes. The friction cone is the linear matrix inequality [23]
///
///   P_i(f_ci) = [mu_i f_i3 + f_i1, f_i2; f_i2, mu_i f_i3 - f_i1] >= 0,   det P_i = (mu_i f_i3)^2 - f_i1^2 -
///   f_i2^2.
///
/// Normal forces must have a finite upper bound, as every hand has. It makes the set of admissible forces
/// compact, so that a problem either has a solution or has a strict certificate that it has none.
struct GraspForceProblem {
  /// Sizes all members: mu = 0.5, f_min = 0, f_max = 100 N, the rest zero. Throws std::invalid_argument for
  /// fewer than three contacts, which cannot balance every wrench.
  explicit GraspForceProblem(int num_contacts);

  int num_contacts() const { return static_cast<int>(mu.size()); }

  Matrix6Xd G;            ///< Grasp map (24), 6 x 3N, object frame, force rows first.
  Vector6d F_o;           ///< Wrench that the contacts must apply, object frame, N and N m.
  VectorXd mu;            ///< Friction coefficients, N, positive.
  VectorXd f_min, f_max;  ///< Bounds on the normal forces f_i3, N, 0 <= f_min < f_max, in N.
};

/// Options of a GraspForceSolver, which minimises the maximum-determinant objective of [23],
///
///   sum_i f_i3 - rho [sum_i log det P_i + sum of log(slack) over all bounds].
///
/// Its optimum is unique, strictly inside every cone and bound, a smooth function of G and F_o, and exceeds
/// the least sum_i f_i3 by at most 4 N rho.
struct GraspForceOptions {
  double barrier_weight = 0.1;        ///< rho, N. The larger, the farther from the cones' boundaries.
  double slack_tolerance = 1e-5;      ///< Relative error of the slacks at which to stop.
  double residual_tolerance = 1e-10;  ///< Largest |G f_c - F_o| (N, N m), relative to max(1, |F_o|).
  int max_iterations = 60;
  bool warm_start = true;  ///< Start from the last solution. A warm start that fails is repeated cold.
};

enum class GraspForceStatus {
  kOptimal,     ///< f_c is feasible, and optimal within the stated duality gap.
  kInfeasible,  ///< No admissible f_c exists; y proves it.
  /// Neither was shown within the iteration limit. Also where admissible f_c exist but none lies strictly
  /// inside its cones and bounds, so that there is no optimum (for example F_o = 0, f_min = 0, no force
  /// closure: f_c = 0).
  kNotConverged,
};

struct GraspForceResult {
  GraspForceStatus status = GraspForceStatus::kNotConverged;
  VectorXd f_c;  ///< Contact forces (49), 3N, N, contact frames. Zero unless kOptimal.
  /// Multipliers, 6. kInfeasible: the direction, in the space of wrenches, along which F_o needs more than
  /// the contacts can give: y^T F_o exceeds y^T G f_c of all admissible f_c (Farkas). |y|_max is then 1.
  VectorXd y;
  double objective = 0.0;  ///< sum_i f_i3, N.
  /// Distance of the barrier objective from its optimum, at most, N.
  double duality_gap = std::numeric_limits<double>::infinity();
  int iterations = 0;         ///< Including those of a failed warm start.
  bool warm_started = false;  ///< Whether the result came from a warm start.
};

namespace grasp_internal {
class InteriorPointKernel;
}

/// Solves grasp-force problems of one size, one after the other, by a primal-dual interior-point method.
/// Solve allocates nothing.
class GraspForceSolver {
 public:
  /// Throws std::invalid_argument for fewer than three contacts or options out of range.
  explicit GraspForceSolver(int num_contacts, const GraspForceOptions& options = {});
  ~GraspForceSolver();
  GraspForceSolver(GraspForceSolver&&) noexcept;
  GraspForceSolver& operator=(GraspForceSolver&&) noexcept;

  /// Solves `problem`; the result is valid until the next call. Throws std::invalid_argument for a size that
  /// differs from the solver's, a number that is not finite, mu <= 0 or crossed bounds; SingularityError if G
  /// has not full row rank.
  const GraspForceResult& Solve(const GraspForceProblem& problem);

  /// Forgets the last solution: the next Solve starts cold.
  void Reset();

  const GraspForceOptions& options() const { return options_; }

 private:
  GraspForceOptions options_;
  GraspForceResult result_;
  std::unique_ptr<grasp_internal::InteriorPointKernel> kernel_;
};

}  // namespace dexcheck
