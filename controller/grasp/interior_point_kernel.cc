#include "controller/grasp/interior_point_kernel.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/grasp/grasp_rank.h"

namespace dexcheck::grasp_internal {
namespace {

// Fraction of the way to the boundary that a step may go.
constexpr double kStepFraction = 0.99;
// The same once a barrier problem has taken kPatience iterations: corrected steps can cycle where the
// admissible forces are few; uncorrected, shorter ones do not.
constexpr double kCautiousFraction = 0.7;
constexpr int kPatience = 30;
// Least fraction of the present complementarity that a corrected step aims at.
constexpr double kLeastCentering = 0.03;
// A barrier problem aims at its target directly once its complementarity is within this factor of it.
constexpr double kNearFactor = 3.0;
// Relative duality gap of the iterate that is kept for a warm start of the linear objective. Later iterates
// lie too close to the boundary to follow a moving problem.
constexpr double kSavedGap = 3e-3;
// Multiple of the residual tolerance from which x alone is moved to the equality constraints.
constexpr double kPolishRange = 1e4;
// Smallest separation per unit of |y|_1, in N or N m, that counts as a proof of infeasibility: above
// rounding.
constexpr double kProof = 1e-9;
// Determinant of the first normal equations, scaled to unit diagonal, up to which G may lack rank: above
// rounding, which is 36 (3 N + 20) eps at most, because no cofactor of such a matrix exceeds one. It is also
// small for bounds of very different sizes, so that G itself has to be looked at.
constexpr double kSuspiciousDeterminant = 1e-10;

}  // namespace

template <int kPacks, int kRows>
InteriorPointKernel<kPacks, kRows>::InteriorPointKernel(int num_contacts, int num_limits)
    : packs_(BufferOf<ContactPack, kPacks>::Make(
          static_cast<std::size_t>((num_contacts + kLanes - 1) / kLanes))),
      equations_(static_cast<std::size_t>(6 + num_limits)) {
  const std::size_t rows = static_cast<std::size_t>(6 + num_limits);
  h_ = BufferOf<Lanes3, kPacks>::Make(num_packs());
  A_ = M_ = BufferOf<Lanes3, kEntries>::Make(num_packs() * rows);
  b_ = y_ = dy_ = saved_y_ = residual_ = BufferOf<double, kRows>::Make(rows);
  limits_.resize(rows - 6);
  saved_limits_.resize(rows - 6);
  std::fill(A_.begin(), A_.end(), ZeroLanes3());
}

template <int kPacks, int kRows>
void InteriorPointKernel<kPacks, kRows>::Load(const GraspForceProblem& problem) {
  for (Eigen::Index i = 0; i < problem.num_contacts(); ++i) {
    const std::size_t p = static_cast<std::size_t>(i) / kLanes;
    const Eigen::Index lane = i % kLanes;
    const double inv_mu = 1.0 / problem.mu[i];
    ContactPack& c = packs_[p];
    c.mu[lane] = problem.mu[i];
    c.w[lane] = problem.weight[i] * inv_mu;
    c.lower[lane] = problem.mu[i] * problem.f_min[i];
    c.upper[lane] = problem.mu[i] * problem.f_max[i];
    Lanes3* A = &A_[p * num_rows()];
    for (Eigen::Index k = 0; k < 6; ++k) {
      A[k][0][lane] = problem.G(k, 3 * i + 2) * inv_mu;
      A[k][1][lane] = problem.G(k, 3 * i);
      A[k][2][lane] = problem.G(k, 3 * i + 1);
    }
    for (Eigen::Index j = 0; j < problem.num_limits(); ++j) {
      A[6 + j][0][lane] = problem.A(j, 3 * i + 2) * inv_mu;
      A[6 + j][1][lane] = problem.A(j, 3 * i);
      A[6 + j][2][lane] = problem.A(j, 3 * i + 1);
    }
  }
  for (std::size_t k = 0; k < 6; ++k) b_[k] = problem.F_o[static_cast<Eigen::Index>(k)];
  for (std::size_t j = 0; j < num_limits(); ++j) {
    limits_[j].lower = problem.a_min[static_cast<Eigen::Index>(j)];
    limits_[j].upper = problem.a_max[static_cast<Eigen::Index>(j)];
  }
}

// y = 0, every contact at the centre for a target that suits the costliest of them.
template <int kPacks, int kRows>
void InteriorPointKernel<kPacks, kRows>::StartCold(double barrier_weight) {
  double target = barrier_weight;
  for (const ContactPack& c : packs_) {
    target = std::max(target, (0.25 * c.w * (c.lower + c.upper)).maxCoeff());
  }
  for (ContactPack& c : packs_) c.SetCenter(target);
  for (Limit& l : limits_) {
    l.t = 0.5 * (l.lower + l.upper);
    l.bounds.SetValue(l.t, l.lower, l.upper);
    l.bounds.z_lower = l.bounds.z_upper = target / l.bounds.slack_lower;
  }
  std::fill(y_.begin(), y_.end(), 0.0);
}

template <int kPacks, int kRows>
void InteriorPointKernel<kPacks, kRows>::Save() {
  for (ContactPack& c : packs_) c.saved = c.at;
  saved_limits_ = limits_;
  saved_y_ = y_;
}

template <int kPacks, int kRows>
void InteriorPointKernel<kPacks, kRows>::Restore() {
  for (ContactPack& c : packs_) c.at = c.saved;
  for (std::size_t j = 0; j < num_limits(); ++j) {
    limits_[j].t = saved_limits_[j].t;
    limits_[j].bounds = saved_limits_[j].bounds;
  }
  y_ = saved_y_;
}

// Measures the last iterate against the present bounds; false if it lies outside.
template <int kPacks, int kRows>
bool InteriorPointKernel<kPacks, kRows>::StartWarm() {
  bool inside = true;
  for (ContactPack& c : packs_) {
    c.at.bounds.SetValue(c.at.x[0], c.lower, c.upper);
    inside &= c.at.bounds.slack_lower.minCoeff() > 0.0 && c.at.bounds.slack_upper.minCoeff() > 0.0;
  }
  for (Limit& l : limits_) {
    l.bounds.SetValue(l.t, l.lower, l.upper);
    inside &= l.bounds.slack_lower > 0.0 && l.bounds.slack_upper > 0.0;
  }
  return inside;
}

template <int kPacks, int kRows>
void InteriorPointKernel<kPacks, kRows>::CalcResiduals() {
  residual_ = b_;
  gap_ = 0.0;
  objective_ = 0.0;
  Lanes largest_dual = Lanes::Zero();
  for (std::size_t p = 0; p < num_packs(); ++p) {
    ContactPack& c = packs_[p];
    const auto& [x, s, bounds] = c.at;
    Lanes3 g = {c.w - s[0] - (bounds.z_lower - bounds.z_upper), -s[1], -s[2]};
    AddCombination(&A(p, 0), y_, -1.0, g);
    for (std::size_t k = 0; k < num_rows(); ++k) residual_[k] -= CalcDot(A(p, k), x).sum();
    c.dual_residual = g;
    largest_dual = largest_dual.max(g[0].abs()).max(g[1].abs()).max(g[2].abs());
    gap_ += (CalcDot(x, s) + bounds.CalcGap()).sum();
    objective_ += (c.w * x[0]).sum();
  }
  max_dual_residual_ = largest_dual.maxCoeff();
  for (std::size_t j = 0; j < num_limits(); ++j) {
    Limit& l = limits_[j];
    residual_[6 + j] += l.t;
    l.dual_residual = y_[6 + j] - (l.bounds.z_lower - l.bounds.z_upper);
    max_dual_residual_ = std::max(max_dual_residual_, std::abs(l.dual_residual));
    gap_ += l.bounds.CalcGap();
  }
  max_residual_ = 0.0;
  for (const double r : residual_) max_residual_ = std::max(max_residual_, std::abs(r));
}

// The Lagrangian's minimum over all cones and bounds, a lower bound on the linear objective:
//   b^T y - sum_i max_{x in C_i} (A_i^T y - w_i e)^T x + sum_j min(lower_j y_j, upper_j y_j)
// with C_i = {x in K, lower <= x0 <= upper}.
template <int kPacks, int kRows>
double InteriorPointKernel<kPacks, kRows>::CalcBound(bool with_cost) const {
  double bound = 0.0;
  for (std::size_t k = 0; k < num_rows(); ++k) bound += b_[k] * y_[k];
  for (std::size_t p = 0; p < num_packs(); ++p) {
    const ContactPack& c = packs_[p];
    Lanes3 g = ZeroLanes3();
    if (with_cost) g[0] = -c.w;
    AddCombination(&A(p, 0), y_, 1.0, g);
    bound -= c.CalcSupport(g).sum();
  }
  for (std::size_t j = 0; j < num_limits(); ++j) {
    bound += std::min(limits_[j].lower * y_[6 + j], limits_[j].upper * y_[6 + j]);
  }
  return bound;
}

// S = sum_i M_i M_i^T with M_i = A_i W_i R_i, and the limits' part.
template <int kPacks, int kRows>
void InteriorPointKernel<kPacks, kRows>::Factor() {
  equations_.SetZero();
  for (std::size_t p = 0; p < num_packs(); ++p) {
    ContactPack& c = packs_[p];
    c.CalcScaling();
    for (std::size_t k = 0; k < num_rows(); ++k) {
      const Lanes3& a = A(p, k);
      Lanes3& m = M_[p * num_rows() + k];
      for (std::size_t j = 0; j < 3; ++j) m[j] = a[0] * c.K[0][j] + a[1] * c.K[1][j] + a[2] * c.K[2][j];
      for (std::size_t l = 0; l <= k; ++l) equations_(k, l) += CalcDot(m, M(p, l)).sum();
    }
  }
  for (std::size_t j = 0; j < num_limits(); ++j) {
    limits_[j].bounds.CalcScaling();
    equations_(6 + j, 6 + j) += 1.0 / limits_[j].bounds.curvature();
  }
  equations_.Factor();
}

template <int kPacks, int kRows>
void InteriorPointKernel<kPacks, kRows>::Aim(double target) {
  for (ContactPack& c : packs_) c.Aim(target);
  for (Limit& l : limits_) l.bounds.Aim(target);
}

template <int kPacks, int kRows>
void InteriorPointKernel<kPacks, kRows>::AimCorrected(double target) {
  for (ContactPack& c : packs_) c.AimCorrected(target);
  for (Limit& l : limits_) l.bounds.AimCorrected(target, l.dt);
}

// Solves the Newton equations for the present aim; returns the longest step that stays inside.
template <int kPacks, int kRows>
double InteriorPointKernel<kPacks, kRows>::CalcDirection() {
  // S dy = residual - sum_i M_i h_i,  h_i the direction for dy = 0.
  dy_ = residual_;
  for (std::size_t p = 0; p < num_packs(); ++p) {
    h_[p] = packs_[p].CalcFreeDirection();
    for (std::size_t k = 0; k < num_rows(); ++k) dy_[k] -= CalcDot(M(p, k), h_[p]).sum();
  }
  for (std::size_t j = 0; j < num_limits(); ++j) dy_[6 + j] += limits_[j].CalcFreeStep();
  equations_.Solve(dy_);

  // R_i^-1 dx_scaled = h_i + M_i^T dy.
  Lanes inverse_step = Lanes::Zero();
  for (std::size_t p = 0; p < num_packs(); ++p) {
    Lanes3 g = h_[p];
    AddCombination(&M(p, 0), dy_, 1.0, g);
    inverse_step = inverse_step.max(packs_[p].SetDirection(g));
  }
  double inverse = inverse_step.maxCoeff();
  for (std::size_t j = 0; j < num_limits(); ++j) {
    Limit& l = limits_[j];
    l.dt = l.CalcFreeStep() - dy_[6 + j] / l.bounds.curvature();
    l.bounds.SetDirection(l.dt);
    inverse = std::max(inverse, l.bounds.CalcInverseStep(l.dt));
  }
  return 1.0 / inverse;
}

template <int kPacks, int kRows>
void InteriorPointKernel<kPacks, kRows>::Advance(double step) {
  for (std::size_t p = 0; p < num_packs(); ++p) {
    // ds = dual_residual - A^T dy - (dz_lower - dz_upper) e keeps the dual equation; W^-1 ds_scaled drifts.
    ContactPack& c = packs_[p];
    Lanes3 ds = c.dual_residual;
    ds[0] -= c.at.bounds.CalcMultiplierStep();
    AddCombination(&A(p, 0), dy_, -1.0, ds);
    for (std::size_t j = 0; j < 3; ++j) c.at.s[j] += step * ds[j];
    for (std::size_t j = 0; j < 3; ++j) c.at.x[j] += step * c.dx[j];
    c.at.bounds.Advance(step, c.dx[0]);
  }
  for (Limit& l : limits_) {
    l.t += step * l.dt;
    l.bounds.Advance(step, l.dt);
  }
  for (std::size_t k = 0; k < num_rows(); ++k) y_[k] += step * dy_[k];
}

// Moves x alone, by the smallest step in the last scaling, to the equality constraints; false if that would
// leave the interior. The last Newton steps of the linear objective, whose scaling is extreme, need it.
template <int kPacks, int kRows>
bool InteriorPointKernel<kPacks, kRows>::RestoreFeasibility() {
  dy_ = residual_;
  equations_.Solve(dy_);
  Lanes inverse_step = Lanes::Zero();
  for (std::size_t p = 0; p < num_packs(); ++p) {
    Lanes3 g = ZeroLanes3();
    AddCombination(&M(p, 0), dy_, 1.0, g);
    inverse_step = inverse_step.max(packs_[p].SetPrimalDirection(g));
  }
  double inverse = inverse_step.maxCoeff();
  for (std::size_t j = 0; j < num_limits(); ++j) {
    Limit& l = limits_[j];
    l.dt = -dy_[6 + j] / l.bounds.curvature();
    inverse = std::max(inverse, l.bounds.CalcInversePrimalStep(l.dt));
  }
  if (!(inverse < kStepFraction)) return false;
  for (ContactPack& c : packs_) {
    for (std::size_t j = 0; j < 3; ++j) c.at.x[j] += c.dx[j];
    c.at.bounds.AdvanceValue(c.dx[0]);
  }
  for (Limit& l : limits_) {
    l.t += l.dt;
    l.bounds.AdvanceValue(l.dt);
  }
  return true;
}

// Upper bound on the distance of the chosen objective from its optimum.
template <int kPacks, int kRows>
double InteriorPointKernel<kPacks, kRows>::CalcGap(const GraspForceOptions& options) const {
  if (options.objective == GraspForceObjective::kMinimum) return objective_ - CalcBound(true);
  double gap = 0.0;
  for (const ContactPack& c : packs_) gap += c.CalcBarrierGap(options.barrier_weight).sum();
  for (const Limit& l : limits_) gap += l.bounds.CalcBarrierGap(options.barrier_weight);
  return gap;
}

template <int kPacks, int kRows>
bool InteriorPointKernel<kPacks, kRows>::ProvesInfeasibility() const {
  double size = 0.0;
  for (const double y : y_) size += std::abs(y);
  return CalcBound(false) > kProof * size;
}

template <int kPacks, int kRows>
GraspForceStatus InteriorPointKernel<kPacks, kRows>::Iterate(const Matrix6Xd& G,
                                                             const GraspForceOptions& options, bool warm,
                                                             int& iterations) {
  const bool barrier = options.objective == GraspForceObjective::kBarrier;
  const double rho = barrier ? options.barrier_weight : 0.0;
  double size = 1.0;
  for (const double b : b_) size = std::max(size, std::abs(b));
  const double tolerance = options.residual_tolerance * size;
  const double barrier_gap = 0.5 * rho * options.slack_tolerance * options.slack_tolerance;
  bool saved = false;
  double step = 1.0;
  for (int i = 0;; ++i, ++iterations) {
    CalcResiduals();
    const double scale = std::max(1.0, objective_);
    const bool feasible =
        max_residual_ <= tolerance && (!barrier || max_dual_residual_ <= options.residual_tolerance);
    const bool nearly_feasible = feasible || (!barrier && max_residual_ <= kPolishRange * tolerance);
    const bool closed =
        nearly_feasible && CalcGap(options) <= (barrier ? barrier_gap : options.gap_tolerance * scale);
    if (feasible && closed) return GraspForceStatus::kOptimal;
    if (!feasible && i > 0 && ProvesInfeasibility()) return GraspForceStatus::kInfeasible;
    if (i == options.max_iterations || !std::isfinite(gap_)) return GraspForceStatus::kNotConverged;
    if (closed && i > 0 && RestoreFeasibility()) continue;
    if (!barrier && !saved && (warm ? i > 0 : gap_ <= kSavedGap * scale)) {
      Save();
      saved = true;
    }

    Factor();
    if (!warm && i == 0 && !(equations_.CalcScaledDeterminant(6) > kSuspiciousDeterminant))
      RequireFullRank(G);

    const double mu = gap_ / CalcDegree();
    const bool cautious = barrier && i >= kPatience;
    if (!barrier && warm && i == 0) {
      // Follow the problem to the same place on the central path, whence the next warm start.
      Aim(kSavedGap * scale / CalcDegree());
    } else if (cautious) {
      Aim(std::max(rho, 0.2 * mu));
    } else {
      // A predictor aims at rho if near, else as far as it gets; the corrector allows for its second-order
      // error.
      const bool near = barrier && step == 1.0 && mu < kNearFactor * rho && mu > rho / kNearFactor;
      Aim(near ? rho : 0.0);
      const double shortfall = 1.0 - std::min(1.0, CalcDirection());
      const double reachable = mu * std::max(kLeastCentering, shortfall * shortfall * shortfall);
      AimCorrected(near ? rho : std::max(rho, reachable));
    }
    step = std::min(1.0, (cautious ? kCautiousFraction : kStepFraction) * CalcDirection());
    Advance(step);
  }
}

template <int kPacks, int kRows>
void InteriorPointKernel<kPacks, kRows>::Solve(const GraspForceProblem& problem,
                                               const GraspForceOptions& options, GraspForceResult& result) {
  Load(problem);
  result.iterations = 0;
  result.status = GraspForceStatus::kNotConverged;
  result.warm_started = options.warm_start && has_last_;
  has_last_ = false;
  if (result.warm_started) {
    if (options.objective == GraspForceObjective::kMinimum) Restore();
    result.warm_started = StartWarm();
  }
  if (result.warm_started) result.status = Iterate(problem.G, options, true, result.iterations);
  if (result.status == GraspForceStatus::kNotConverged) {
    result.warm_started = false;
    StartCold(options.barrier_weight);
    result.status = Iterate(problem.G, options, false, result.iterations);
  }
  has_last_ = result.status == GraspForceStatus::kOptimal;
  Report(problem, options, result);
}

template <int kPacks, int kRows>
void InteriorPointKernel<kPacks, kRows>::Report(const GraspForceProblem& problem,
                                                const GraspForceOptions& options,
                                                GraspForceResult& result) const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const bool optimal = result.status == GraspForceStatus::kOptimal;
  const bool infeasible = result.status == GraspForceStatus::kInfeasible;
  result.residual = max_residual_;
  result.objective = optimal ? objective_ : 0.0;
  result.lower_bound = optimal ? CalcBound(true) : -kInfinity;
  result.duality_gap = optimal ? CalcGap(options) : kInfinity;
  double y_scale = 1.0;
  if (infeasible) {
    double largest = 0.0;
    for (const double y : y_) largest = std::max(largest, std::abs(y));
    y_scale = 1.0 / largest;
  }
  for (std::size_t k = 0; k < num_rows(); ++k) result.y[static_cast<Eigen::Index>(k)] = y_scale * y_[k];
  result.infeasibility = infeasible ? y_scale * CalcBound(false) : 0.0;

  result.f_c.setZero();
  result.cone_margin = 0.0;
  if (!optimal) return;
  result.cone_margin = kInfinity;
  for (Eigen::Index i = 0; i < problem.num_contacts(); ++i) {
    const Eigen::Index lane = i % kLanes;
    const Lanes3& x = packs_[static_cast<std::size_t>(i) / kLanes].at.x;
    result.f_c.segment<3>(3 * i) << x[1][lane], x[2][lane], x[0][lane] / problem.mu[i];
    result.cone_margin = std::min(result.cone_margin,
                                  x[0][lane] - std::sqrt(x[1][lane] * x[1][lane] + x[2][lane] * x[2][lane]));
  }
}

std::unique_ptr<GraspForceKernel> MakeGraspForceKernel(int num_contacts, int num_limits) {
  if (num_limits == 0 && num_contacts <= kLanes) {
    return std::make_unique<InteriorPointKernel<1, 6>>(num_contacts, 0);
  }
  if (num_limits == 0 && num_contacts <= 2 * kLanes) {
    return std::make_unique<InteriorPointKernel<2, 6>>(num_contacts, 0);
  }
  return std::make_unique<InteriorPointKernel<kAnySize, kAnySize>>(num_contacts, num_limits);
}

}  // namespace dexcheck::grasp_internal
