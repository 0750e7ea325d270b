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

/// One grasp-force problem for N hard-finger contacts (20) and M limited linear functions of the contact
/// forces:
///
///   G f_c = F_o,   |(f_i1, f_i2)| <= mu_i f_i3,   f_min_i <= f_i3 <= f_max_i,   a_min <= A f_c <= a_max.
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
  /// Sizes all members: mu = 0.5, f_min = 0, f_max = 100 N, weight = 1, the rest zero. Throws
  /// std::invalid_argument for fewer than three contacts, which cannot balance every wrench, and for
  /// num_limits < 0.
  explicit GraspForceProblem(int num_contacts, int num_limits = 0);

  int num_contacts() const { return static_cast<int>(mu.size()); }
  int num_limits() const { return static_cast<int>(A.rows()); }

  /// Sets rows of A for the joint-torque limits tau_min <= tau_0 + J^T f_c <= tau_max of (48), (55), where
  /// the actuators carry what the object pushes back: A = J^T, a_min = tau_min - tau_0, a_max = tau_max -
  /// tau_0. J (3N x M) maps joint rates to contact-point velocities; tau_0, tau_min, tau_max (M) in N m.
  /// Throws std::invalid_argument if a size differs from M.
  void SetTorqueLimits(const Eigen::Ref<const MatrixXd>& J, const Eigen::Ref<const VectorXd>& tau_0,
                       const Eigen::Ref<const VectorXd>& tau_min, const Eigen::Ref<const VectorXd>& tau_max);

  Matrix6Xd G;            ///< Grasp map (24), 6 x 3N, object frame, force rows first.
  Vector6d F_o;           ///< Wrench that the contacts must apply, object frame, N and N m.
  VectorXd mu;            ///< Friction coefficients, N, positive.
  VectorXd f_min, f_max;  ///< Bounds on the normal forces f_i3, N, 0 <= f_min < f_max, in N.
  VectorXd weight;        ///< Weights of the normal forces in the objective, N, not negative.
  MatrixXd A;             ///< Limited functions of f_c, M x 3N.
  VectorXd a_min, a_max;  ///< Their bounds, M, finite, a_min < a_max.
};

/// What a GraspForceSolver minimises.
enum class GraspForceObjective {
  /// sum_i weight_i f_i3: the linear objective of a semidefinite program. At least one constraint is active
  /// at the
  /// optimum, and the optimum is not a smooth function of G and F_o.
  kMinimum,
  /// sum_i weight_i f_i3 - rho [sum_i log det P_i + sum of log(slack) over all bounds]: the
  /// maximum-determinant objective
  /// of [23]. Its optimum is unique, strictly inside every cone and bound, a smooth function of G and F_o,
  /// and exceeds
  /// the minimum of the linear objective by at most rho (4 N + 2 M).
  kBarrier,
};

struct GraspForceOptions {
  GraspForceObjective objective = GraspForceObjective::kBarrier;
  double barrier_weight = 0.1;  ///< rho, N. The larger, the farther from the cones' boundaries.
  double gap_tolerance = 1e-7;  ///< kMinimum: duality gap at which to stop, relative to max(1 N, objective).
  double slack_tolerance = 1e-5;      ///< kBarrier: relative error of the slacks at which to stop.
  double residual_tolerance = 1e-10;  ///< Largest |G f_c - F_o| (N, N m), relative to max(1, |F_o|).
  int max_iterations = 60;
  bool warm_start = true;  ///< Start from the last solution. A warm start that fails is repeated cold.
};

enum class GraspForceStatus {
  kOptimal,     ///< f_c is feasible, and optimal within the stated duality gap.
  kInfeasible,  ///< No admissible f_c exists; y proves it.
  /// Neither was shown within the iteration limit. With kBarrier also where admissible f_c exist but none
  /// lies strictly inside its cones and bounds, so that there is no optimum (for example F_o = 0, f_min = 0,
  /// no force closure: f_c = 0).
  kNotConverged,
};

struct GraspForceResult {
  GraspForceStatus status = GraspForceStatus::kNotConverged;
  VectorXd f_c;  ///< Contact forces (49), 3N, N, contact frames. Zero unless kOptimal.
  /// Multipliers, 6 + M. kOptimal: CalcGraspForceBound(problem, y) is a lower bound on the linear objective.
  /// kInfeasible: CalcInfeasibility(problem, y) > 0; y[0..5] is the direction, in the space of wrenches,
  /// along which F_o asks for more than the contacts can give.
  VectorXd y;
  double objective = 0.0;    ///< sum_i weight_i f_i3, N.
  double lower_bound = 0.0;  ///< On the linear objective, from y, N. Minus infinity unless kOptimal.
  /// Distance of the chosen objective from its optimum, at most, N: objective - lower_bound for kMinimum.
  double duality_gap = std::numeric_limits<double>::infinity();
  double residual = 0.0;       ///< Largest entry of |G f_c - F_o|, N or N m.
  double cone_margin = 0.0;    ///< min_i mu_i f_i3 - |(f_i1, f_i2)|, N.
  double infeasibility = 0.0;  ///< CalcInfeasibility for kInfeasible, else zero.
  int iterations = 0;          ///< Including those of a failed warm start.
  bool warm_started = false;   ///< Whether the result came from a warm start.
};

/// Lower bound on sum_i weight_i f_i3 over the admissible contact forces, by weak duality and in closed form,
/// for any y:
///   y^T [F_o; 0] - sum_i max_{f in C_i} ((G_i^T y_G + A_i^T y_A)_i - weight_i e_3)^T f + sum_j min(y_j
///   a_min_j, y_j a_max_j)
/// with C_i the friction cone between its bounds on f_i3. `y` has 6 + M entries.
double CalcGraspForceBound(const GraspForceProblem& problem, const Eigen::Ref<const VectorXd>& y);

/// By how much y separates F_o from the wrenches that admissible contact forces can give: CalcGraspForceBound
/// with all weights zero. Positive: the problem has no solution (Farkas). `y` has 6 + M entries.
double CalcInfeasibility(const GraspForceProblem& problem, const Eigen::Ref<const VectorXd>& y);

/// F_N = f_c - G^+ F_o of (49), with G^+ = G^T (G G^T)^-1; G F_N = 0 (27) if G f_c = F_o. `G` 6 x 3N, `f_c`
/// 3N. Throws SingularityError if G has not full row rank.
VectorXd CalcInternalForce(const Eigen::Ref<const Matrix6Xd>& G, const Eigen::Ref<const Vector6d>& F_o,
                           const Eigen::Ref<const VectorXd>& f_c);

/// min_i mu_i f_i3 - |(f_i1, f_i2)|, N: not negative if and only if all forces are in their cones (21).
double CalcLeastConeMargin(const Eigen::Ref<const VectorXd>& f_c, const Eigen::Ref<const VectorXd>& mu);

namespace grasp_internal {
class GraspForceKernel;
}

/// Solves grasp-force problems of one size, one after the other, by a primal-dual interior-point method.
/// Solve allocates nothing. Up to eight contacts without limits run on code specialised for the size.
class GraspForceSolver {
 public:
  /// Throws std::invalid_argument for fewer than three contacts or options out of range.
  explicit GraspForceSolver(int num_contacts, int num_limits = 0, const GraspForceOptions& options = {});
  ~GraspForceSolver();
  GraspForceSolver(GraspForceSolver&&) noexcept;
  GraspForceSolver& operator=(GraspForceSolver&&) noexcept;

  /// Solves `problem`; the result is valid until the next call. Throws std::invalid_argument for a size that
  /// differs from the solver's, a number that is not finite, mu <= 0, a negative weight or crossed bounds;
  /// SingularityError if G has not full row rank.
  const GraspForceResult& Solve(const GraspForceProblem& problem);

  /// Forgets the last solution: the next Solve starts cold.
  void Reset();

  const GraspForceOptions& options() const { return options_; }

 private:
  GraspForceOptions options_;
  GraspForceResult result_;
  std::unique_ptr<grasp_internal::GraspForceKernel> kernel_;
};

}  // namespace dexcheck
