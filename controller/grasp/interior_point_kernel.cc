#include "controller/grasp/interior_point_kernel.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/grasp/grasp_rank.h"

namespace dexcheck::grasp_internal {
namespace {

// Fraction of the way to the boundary that a step may go.
constexpr double kStepFraction = 0.99;
// The same once a problem has taken kPatience iterations: corrected steps can cycle where the admissible
// forces are few; uncorrected, shorter ones do not.
constexpr double kCautiousFraction = 0.7;
constexpr int kPatience = 30;
// Least fraction of the present complementarity that a corrected step aims at.
constexpr double kLeastCentering = 0.03;
// Steps aim at their target directly once the complementarity is within this factor of it.
constexpr double kNearFactor = 3.0;
// Smallest separation per unit of |y|_1, in N or N m, that counts as a proof of infeasibility: above
// rounding.
constexpr double kProof = 1e-9;
// Determinant of the first normal equations, scaled to unit diagonal, up to which G may lack rank: above
// rounding, which is 36 (3 N + 20) eps at most, because no cofactor of such a matrix exceeds one. It is also
// small for bounds of very different sizes, so that G itself has to be looked at.
constexpr double kSuspiciousDeterminant = 1e-10;

/// g += factor rows^T y.
void AddCombination(const std::array<Lanes3, kRows>& rows, const RowVector& y, double factor, Lanes3& g) {
  for (std::size_t k = 0; k < kRows; ++k) {
    for (std::size_t j = 0; j < 3; ++j) g[j] += rows[k][j] * (factor * y[k]);
  }
}

}  // namespace

void NormalEquations::Factor() {
  for (std::size_t j = 0; j < kRows; ++j) diagonal_[j] = (*this)(j, j);
  for (std::size_t j = 0; j < kRows; ++j) {
    const double inv_pivot = 1.0 / (*this)(j, j);
    inv_pivots_[j] = inv_pivot;
    for (std::size_t i = j + 1; i < kRows; ++i) {
      const double l = (*this)(i, j) * inv_pivot;
      for (std::size_t k = j + 1; k <= i; ++k) (*this)(i, k) -= l * (*this)(k, j);
    }
    for (std::size_t i = j + 1; i < kRows; ++i) (*this)(i, j) *= inv_pivot;
  }
}

double NormalEquations::CalcScaledDeterminant() const {
  double determinant = 1.0;
  for (std::size_t j = 0; j < kRows; ++j) determinant /= inv_pivots_[j] * diagonal_[j];
  return determinant;
}

void NormalEquations::Solve(RowVector& b) {
  for (std::size_t j = 0; j < kRows; ++j) {
    for (std::size_t i = j + 1; i < kRows; ++i) b[i] -= (*this)(i, j) * b[j];
  }
  for (std::size_t j = 0; j < kRows; ++j) b[j] *= inv_pivots_[j];
  for (std::size_t j = kRows; j-- > 0;) {
    for (std::size_t i = 0; i < j; ++i) b[i] -= (*this)(j, i) * b[j];
  }
}

InteriorPointKernel::InteriorPointKernel(int num_contacts)
    : packs_(static_cast<std::size_t>((num_contacts + kLanes - 1) / kLanes)) {
  for (Pack& pack : packs_) pack.A.fill(ZeroLanes3());
}

void InteriorPointKernel::Load(const GraspForceProblem& problem) {
  for (Eigen::Index i = 0; i < problem.num_contacts(); ++i) {
    const Eigen::Index lane = i % kLanes;
    const double inv_mu = 1.0 / problem.mu[i];
    Pack& c = packs_[static_cast<std::size_t>(i) / kLanes];
    c.mu[lane] = problem.mu[i];
    c.w[lane] = inv_mu;
    c.lower[lane] = problem.mu[i] * problem.f_min[i];
    c.upper[lane] = problem.mu[i] * problem.f_max[i];
    for (std::size_t k = 0; k < kRows; ++k) {
      const auto row = problem.G.row(static_cast<Eigen::Index>(k)).segment<3>(3 * i);
      c.A[k][0][lane] = row[2] * inv_mu;
      c.A[k][1][lane] = row[0];
      c.A[k][2][lane] = row[1];
    }
  }
  for (std::size_t k = 0; k < kRows; ++k) b_[k] = problem.F_o[static_cast<Eigen::Index>(k)];
}

// y = 0, every contact at the centre for a target that suits the costliest of them.
void InteriorPointKernel::StartCold(double barrier_weight) {
  double target = barrier_weight;
  for (const Pack& c : packs_) target = std::max(target, (0.25 * c.w * (c.lower + c.upper)).maxCoeff());
  for (Pack& c : packs_) c.SetCenter(target);
  y_.fill(0.0);
}

// Measures the last iterate against the present bounds; false if it lies outside.
bool InteriorPointKernel::StartWarm() {
  bool inside = true;
  for (Pack& c : packs_) {
    c.bounds.SetValue(c.x[0], c.lower, c.upper);
    inside &= c.bounds.slack_lower.minCoeff() > 0.0 && c.bounds.slack_upper.minCoeff() > 0.0;
  }
  return inside;
}

void InteriorPointKernel::CalcResiduals() {
  residual_ = b_;
  gap_ = 0.0;
  objective_ = 0.0;
  Lanes largest_dual = Lanes::Zero();
  for (Pack& c : packs_) {
    Lanes3 g = {c.w - c.s[0] - (c.bounds.z_lower - c.bounds.z_upper), -c.s[1], -c.s[2]};
    AddCombination(c.A, y_, -1.0, g);
    for (std::size_t k = 0; k < kRows; ++k) residual_[k] -= CalcDot(c.A[k], c.x).sum();
    c.dual_residual = g;
    largest_dual = largest_dual.max(g[0].abs()).max(g[1].abs()).max(g[2].abs());
    gap_ += (CalcDot(c.x, c.s) + c.bounds.CalcGap()).sum();
    objective_ += (c.w * c.x[0]).sum();
  }
  max_dual_residual_ = largest_dual.maxCoeff();
  max_residual_ = 0.0;
  for (const double r : residual_) max_residual_ = std::max(max_residual_, std::abs(r));
}

// By how much y separates F_o from the wrenches that admissible forces give:
//   b^T y - sum_i max_{x in C_i} (A_i^T y)^T x,   C_i = {x in K, lower <= x0 <= upper}.
double InteriorPointKernel::CalcSeparation() const {
  double separation = 0.0;
  for (std::size_t k = 0; k < kRows; ++k) separation += b_[k] * y_[k];
  for (const Pack& c : packs_) {
    Lanes3 g = ZeroLanes3();
    AddCombination(c.A, y_, 1.0, g);
    separation -= c.CalcSupport(g).sum();
  }
  return separation;
}

// S = sum_i M_i M_i^T with M_i = A_i W_i R_i.
void InteriorPointKernel::Factor() {
  equations_.SetZero();
  for (Pack& c : packs_) {
    c.CalcScaling();
    for (std::size_t k = 0; k < kRows; ++k) {
      const Lanes3& a = c.A[k];
      Lanes3& m = c.M[k];
      for (std::size_t j = 0; j < 3; ++j) m[j] = a[0] * c.K[0][j] + a[1] * c.K[1][j] + a[2] * c.K[2][j];
      for (std::size_t l = 0; l <= k; ++l) equations_(k, l) += CalcDot(m, c.M[l]).sum();
    }
  }
  equations_.Factor();
}

// Solves the Newton equations for the present aim; returns the longest step that stays inside.
double InteriorPointKernel::CalcDirection() {
  // S dy = residual - sum_i M_i h_i,  h_i the direction for dy = 0.
  dy_ = residual_;
  for (Pack& c : packs_) {
    c.h = c.CalcFreeDirection();
    for (std::size_t k = 0; k < kRows; ++k) dy_[k] -= CalcDot(c.M[k], c.h).sum();
  }
  equations_.Solve(dy_);

  // R_i^-1 dx_scaled = h_i + M_i^T dy.
  Lanes inverse_step = Lanes::Zero();
  for (Pack& c : packs_) {
    Lanes3 g = c.h;
    AddCombination(c.M, dy_, 1.0, g);
    inverse_step = inverse_step.max(c.SetDirection(g));
  }
  return 1.0 / inverse_step.maxCoeff();
}

void InteriorPointKernel::Advance(double step) {
  for (Pack& c : packs_) {
    // ds = dual_residual - A^T dy - (dz_lower - dz_upper) e keeps the dual equation; W^-1 ds_scaled drifts.
    Lanes3 ds = c.dual_residual;
    ds[0] -= c.bounds.CalcMultiplierStep();
    AddCombination(c.A, dy_, -1.0, ds);
    for (std::size_t j = 0; j < 3; ++j) c.s[j] += step * ds[j];
    for (std::size_t j = 0; j < 3; ++j) c.x[j] += step * c.dx[j];
    c.bounds.Advance(step, c.dx[0]);
  }
  for (std::size_t k = 0; k < kRows; ++k) y_[k] += step * dy_[k];
}

// Upper bound on the distance of the objective from its optimum.
double InteriorPointKernel::CalcGap(double rho) const {
  double gap = 0.0;
  for (const Pack& c : packs_) gap += c.CalcBarrierGap(rho).sum();
  return gap;
}

bool InteriorPointKernel::ProvesInfeasibility() const {
  double size = 0.0;
  for (const double y : y_) size += std::abs(y);
  return CalcSeparation() > kProof * size;
}

GraspForceStatus InteriorPointKernel::Iterate(const Matrix6Xd& G, const GraspForceOptions& options, bool warm,
                                              int& iterations) {
  const double rho = options.barrier_weight;
  double size = 1.0;
  for (const double b : b_) size = std::max(size, std::abs(b));
  const double largest_gap = 0.5 * rho * options.slack_tolerance * options.slack_tolerance;
  double step = 1.0;
  for (int i = 0;; ++i, ++iterations) {
    CalcResiduals();
    const bool feasible = max_residual_ <= options.residual_tolerance * size &&
                          max_dual_residual_ <= options.residual_tolerance;
    if (feasible && CalcGap(rho) <= largest_gap) return GraspForceStatus::kOptimal;
    if (!feasible && i > 0 && ProvesInfeasibility()) return GraspForceStatus::kInfeasible;
    if (i == options.max_iterations || !std::isfinite(gap_)) return GraspForceStatus::kNotConverged;

    Factor();
    if (!warm && i == 0 && !(equations_.CalcScaledDeterminant() > kSuspiciousDeterminant)) RequireFullRank(G);

    const double mu = gap_ / CalcDegree();
    const bool cautious = i >= kPatience;
    if (cautious) {
      for (Pack& c : packs_) c.Aim(std::max(rho, 0.2 * mu));
    } else {
      // A predictor aims at rho if near, else as far as it gets; the corrector allows for its second-order
      // error.
      const bool near = step == 1.0 && mu < kNearFactor * rho && mu > rho / kNearFactor;
      for (Pack& c : packs_) c.Aim(near ? rho : 0.0);
      const double shortfall = 1.0 - std::min(1.0, CalcDirection());
      const double reachable = mu * std::max(kLeastCentering, shortfall * shortfall * shortfall);
      for (Pack& c : packs_) c.AimCorrected(near ? rho : std::max(rho, reachable));
    }
    step = std::min(1.0, (cautious ? kCautiousFraction : kStepFraction) * CalcDirection());
    Advance(step);
  }
}

void InteriorPointKernel::Solve(const GraspForceProblem& problem, const GraspForceOptions& options,
                                GraspForceResult& result) {
  Load(problem);
  result.iterations = 0;
  result.status = GraspForceStatus::kNotConverged;
  result.warm_started = options.warm_start && has_last_ && StartWarm();
  has_last_ = false;
  if (result.warm_started) result.status = Iterate(problem.G, options, true, result.iterations);
  if (result.status == GraspForceStatus::kNotConverged) {
    result.warm_started = false;
    StartCold(options.barrier_weight);
    result.status = Iterate(problem.G, options, false, result.iterations);
  }
  has_last_ = result.status == GraspForceStatus::kOptimal;
  Report(problem, options, result);
}

void InteriorPointKernel::Report(const GraspForceProblem& problem, const GraspForceOptions& options,
                                 GraspForceResult& result) const {
  const bool optimal = result.status == GraspForceStatus::kOptimal;
  result.objective = optimal ? objective_ : 0.0;
  result.duality_gap = optimal ? CalcGap(options.barrier_weight) : std::numeric_limits<double>::infinity();
  double largest = 0.0;
  for (const double y : y_) largest = std::max(largest, std::abs(y));
  const double scale = result.status == GraspForceStatus::kInfeasible ? 1.0 / largest : 1.0;
  for (std::size_t k = 0; k < kRows; ++k) result.y[static_cast<Eigen::Index>(k)] = scale * y_[k];
  result.f_c.setZero();
  if (!optimal) return;
  for (Eigen::Index i = 0; i < problem.num_contacts(); ++i) {
    const Eigen::Index lane = i % kLanes;
    const Lanes3& x = packs_[static_cast<std::size_t>(i) / kLanes].x;
    result.f_c.segment<3>(3 * i) << x[1][lane], x[2][lane], x[0][lane] / problem.mu[i];
  }
}

}  // namespace dexcheck::grasp_internal
