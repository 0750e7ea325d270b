#include "controller/grasp/interior_point_kernel.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/grasp/force_closure.h"

namespace dexcheck::grasp_internal {
namespace {

// Fraction of the way to the boundary that a step may go.
constexpr double kStepFraction = 0.99;
// Step fraction after kPatience iterations: corrected steps can cycle where the admissible forces are few;
// uncorrected, shorter ones do not.
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

/// a^T J b with J = diag(1, -1, -1). det x = x^T J x is positive inside the cone {x0 >= |(x1, x2)|}.
double CalcDotJ(const Vector3d& a, const Vector3d& b) { return a[0] * b[0] - a[1] * b[1] - a[2] * b[2]; }

/// Inverse of the longest step along `d` that stays in the cone, from an interior point x; not positive if no
/// step leaves it.
double CalcInverseConeStep(const Vector3d& x, const Vector3d& d) {
  // det(x + d / beta) = 0  <=>  beta^2 + 2 p beta + q = 0,  p = x^T J d / det x,  q = det d / det x.
  const double det = CalcDotJ(x, x);
  const double p = CalcDotJ(x, d) / det;
  const double q = CalcDotJ(d, d) / det;
  return std::sqrt(std::max(p * p - q, 0.0)) - p;
}

/// Sign of d slack / d x0 of the lower and the upper bound.
Eigen::Array2d BoundSigns() { return {1.0, -1.0}; }

}  // namespace

void InteriorPointContact::SetCenter(double target) {
  const double mid = limits.mean();
  x = {mid, 0.0, 0.0};
  s = {2.0 * target / mid, 0.0, 0.0};
  MeasureSlack();
  z[0] = target / slack[0];
  z[1] = s[0] + z[0] - w;
}

void InteriorPointContact::MeasureSlack() { slack = BoundSigns() * (x[0] - limits); }

void InteriorPointContact::CalcScaling() {
  // u = W e = (x + eta^2 J s) / sqrt(2 (k + x^T s)),  k = sqrt(det x det s) = det lambda,  eta^2 = det x / k.
  const double det_x = CalcDotJ(x, x);
  const double det_lambda = std::sqrt(det_x * CalcDotJ(s, s));
  const double eta_squared = det_x / det_lambda;
  const double eta = std::sqrt(eta_squared);
  u_ = (x + eta_squared * Vector3d(s[0], -s[1], -s[2])) / std::sqrt(2.0 * (det_lambda + x.dot(s)));

  // W = [u0, ut^T; ut, eta I + ut ut^T / (eta + u0)],  lambda = W s.
  const Eigen::Vector2d ut = u_.tail<2>();
  W_.row(0) = W_.col(0) = u_;
  W_.bottomRightCorner<2, 2>() = eta * Eigen::Matrix2d::Identity() + ut * ut.transpose() / (eta + u_[0]);
  lambda_ = W_ * s;

  // R = I + r u u^T,  r = -d / (q (1 + q)),  q = sqrt(1 + d |u|^2),  R u = u / q.
  const double d = (z / slack).sum();
  const double q = std::sqrt(1.0 + d * u_.squaredNorm());
  r_ = -d / (q * (1.0 + q));
  K_ = W_ + r_ * (W_ * u_) * u_.transpose();
  K_.row(0) = u_ / q;
  M.noalias() = A * K_;
}

void InteriorPointContact::Aim(double target, bool corrected) {
  // aim = lambda \ (2 target e - dx_scaled o ds_scaled) - lambda.
  Vector3d product(2.0 * target, 0.0, 0.0);
  z_aim_ = target;
  if (corrected) {
    product[0] -= dx_scaled_.dot(ds_scaled_);
    product.tail<2>() = -dx_scaled_[0] * ds_scaled_.tail<2>() - ds_scaled_[0] * dx_scaled_.tail<2>();
    z_aim_ -= BoundSigns() * dx_[0] * dz_;
  }
  const double first = CalcDotJ(lambda_, product) / CalcDotJ(lambda_, lambda_);
  aim_ << first, (product.tail<2>() - first * lambda_.tail<2>()) / lambda_[0];
  aim_ -= lambda_;
  z_aim_ /= slack;
}

void InteriorPointContact::CalcFreeDirection() {
  // R (aim + pull u - W dual_residual), with R u = K^T e taken whole: pull u is large and R all but cancels
  // it.
  h = aim_ - W_ * dual_residual;
  h += r_ * u_.dot(h) * u_ + (BoundSigns() * (z_aim_ - z)).sum() * K_.row(0).transpose();
}

double InteriorPointContact::SetDirection(const Vector6d& dy) {
  const Vector3d g = h + M.transpose() * dy;
  dx_ = K_ * g;
  dx_scaled_ = g + r_ * u_.dot(g) * u_;
  ds_scaled_ = aim_ - dx_scaled_;
  // The linearised complementarity z dslack + slack dz = aim - slack z.
  const Eigen::Array2d dslack = BoundSigns() * dx_[0];
  dz_ = z_aim_ - z - z / slack * dslack;
  const double bounds = std::max((-dslack / slack).maxCoeff(), (-dz_ / z).maxCoeff());
  return std::max(
      {bounds, CalcInverseConeStep(lambda_, dx_scaled_), CalcInverseConeStep(lambda_, ds_scaled_)});
}

void InteriorPointContact::Advance(double step, const Vector6d& dy) {
  // ds = dual_residual - A^T dy - (dz_lower - dz_upper) e keeps the dual equation; W^-1 ds_scaled drifts.
  s += step * (dual_residual - A.transpose() * dy);
  s[0] -= step * (BoundSigns() * dz_).sum();
  x += step * dx_;
  slack += step * dx_[0] * BoundSigns();
  z += step * dz_;
}

// With t1, t2 the eigenvalues of x o s / (2 rho), t1 + t2 = x^T s / rho and t1 t2 = det x det s / (2 rho)^2,
// that is rho sum (t - 1 - log t), and t - 1 - log t <= (t - 1)^2 / t. For a bound, t = slack z / rho.
double InteriorPointContact::CalcBarrierGap(double rho) const {
  const double sum = x.dot(s) / rho;
  const double product = CalcDotJ(x, x) * CalcDotJ(s, s) / (4.0 * rho * rho);
  const Eigen::Array2d t = slack * z / rho;
  return rho * (sum - 4.0 + sum / product + ((t - 1.0).square() / t).sum());
}

// max(lower h, upper h), h = g0 + |(g1, g2)|, g = A^T y.
double InteriorPointContact::CalcSupport(const Vector6d& y) const {
  const Vector3d g = A.transpose() * y;
  return (limits * (g[0] + g.tail<2>().norm())).maxCoeff();
}

void InteriorPointKernel::Load(const GraspForceProblem& problem) {
  for (Eigen::Index i = 0; i < problem.num_contacts(); ++i) {
    InteriorPointContact& c = contacts_[static_cast<std::size_t>(i)];
    const double mu = problem.mu[i];
    c.w = 1.0 / mu;
    c.limits = {mu * problem.f_min[i], mu * problem.f_max[i]};
    c.A << problem.G.col(3 * i + 2) / mu, problem.G.middleCols<2>(3 * i);
  }
  b_ = problem.F_o;
}

// y = 0, every contact at the centre for a target that suits the costliest of them.
void InteriorPointKernel::StartCold(double barrier_weight) {
  double target = barrier_weight;
  for (const InteriorPointContact& c : contacts_) target = std::max(target, 0.25 * c.w * c.limits.sum());
  for (InteriorPointContact& c : contacts_) c.SetCenter(target);
  y_.setZero();
}

// Measures the last iterate against the present bounds; false if it lies outside.
bool InteriorPointKernel::StartWarm() {
  bool inside = true;
  for (InteriorPointContact& c : contacts_) {
    c.MeasureSlack();
    inside &= c.slack.minCoeff() > 0.0;
  }
  return inside;
}

void InteriorPointKernel::CalcResiduals() {
  residual_ = b_;
  gap_ = objective_ = max_dual_residual_ = 0.0;
  for (InteriorPointContact& c : contacts_) {
    residual_.noalias() -= c.A * c.x;
    c.dual_residual = -c.s - c.A.transpose() * y_;
    c.dual_residual[0] += c.w - (BoundSigns() * c.z).sum();
    max_dual_residual_ = std::max(max_dual_residual_, c.dual_residual.cwiseAbs().maxCoeff());
    gap_ += c.x.dot(c.s) + (c.slack * c.z).sum();
    objective_ += c.w * c.x[0];
  }
}

// S = sum_i M_i M_i^T with M_i = A_i W_i R_i.
void InteriorPointKernel::Factor() {
  Eigen::Matrix<double, 6, 6> S = Eigen::Matrix<double, 6, 6>::Zero();
  for (InteriorPointContact& c : contacts_) {
    c.CalcScaling();
    S.noalias() += c.M * c.M.transpose();
  }
  diagonal_ = S.diagonal();
  equations_.compute(S);
}

// Determinant of S after scaling it to a unit diagonal: one for rows of the constraint matrix at right
// angles, zero for dependent ones.
double InteriorPointKernel::CalcScaledDeterminant() const {
  return equations_.vectorD().prod() / diagonal_.prod();
}

// Solves the Newton equations for the present aim; returns the longest step that stays inside.
double InteriorPointKernel::CalcDirection() {
  // S dy = residual - sum_i M_i h_i,  h_i the direction for dy = 0.
  dy_ = residual_;
  for (InteriorPointContact& c : contacts_) {
    c.CalcFreeDirection();
    dy_.noalias() -= c.M * c.h;
  }
  dy_ = equations_.solve(dy_);
  double inverse_step = 0.0;
  for (InteriorPointContact& c : contacts_) inverse_step = std::max(inverse_step, c.SetDirection(dy_));
  return 1.0 / inverse_step;
}

// Upper bound on the distance of the objective from its optimum.
double InteriorPointKernel::CalcGap(double rho) const {
  double gap = 0.0;
  for (const InteriorPointContact& c : contacts_) gap += c.CalcBarrierGap(rho);
  return gap;
}

// Whether y separates F_o from the wrenches that admissible forces give:
//   b^T y - sum_i max_{x in C_i} (A_i^T y)^T x > 0,   C_i = {x in K, lower <= x0 <= upper}.
bool InteriorPointKernel::ProvesInfeasibility() const {
  double separation = b_.dot(y_);
  for (const InteriorPointContact& c : contacts_) separation -= c.CalcSupport(y_);
  return separation > kProof * y_.lpNorm<1>();
}

GraspForceStatus InteriorPointKernel::Iterate(const Matrix6Xd& G, const GraspForceOptions& options, bool warm,
                                              int& iterations) {
  const double rho = options.barrier_weight;
  const double size = std::max(1.0, b_.cwiseAbs().maxCoeff());
  const double degree = 4.0 * static_cast<double>(contacts_.size());  // two a cone, two a pair of bounds
  const double largest_gap = 0.5 * rho * options.slack_tolerance * options.slack_tolerance;
  double step = 1.0;
  for (int i = 0;; ++i, ++iterations) {
    CalcResiduals();
    const bool feasible = residual_.cwiseAbs().maxCoeff() <= options.residual_tolerance * size &&
                          max_dual_residual_ <= options.residual_tolerance;
    if (feasible && CalcGap(rho) <= largest_gap) return GraspForceStatus::kOptimal;
    if (!feasible && i > 0 && ProvesInfeasibility()) return GraspForceStatus::kInfeasible;
    if (i == options.max_iterations || !std::isfinite(gap_)) return GraspForceStatus::kNotConverged;

    Factor();
    if (!warm && i == 0 && !(CalcScaledDeterminant() > kSuspiciousDeterminant)) RequireFullRank(G);

    const double mu = gap_ / degree;
    const bool cautious = i >= kPatience;
    if (cautious) {
      for (InteriorPointContact& c : contacts_) c.Aim(std::max(rho, 0.2 * mu), false);
    } else {
      // A predictor aims at rho if near, else as far as it gets; the corrector allows for its second-order
      // error.
      const bool near = step == 1.0 && mu < kNearFactor * rho && mu > rho / kNearFactor;
      for (InteriorPointContact& c : contacts_) c.Aim(near ? rho : 0.0, false);
      const double shortfall = 1.0 - std::min(1.0, CalcDirection());
      const double reachable = mu * std::max(kLeastCentering, shortfall * shortfall * shortfall);
      for (InteriorPointContact& c : contacts_) c.Aim(near ? rho : std::max(rho, reachable), true);
    }
    step = std::min(1.0, (cautious ? kCautiousFraction : kStepFraction) * CalcDirection());
    for (InteriorPointContact& c : contacts_) c.Advance(step, dy_);
    y_ += step * dy_;
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
  result.y = y_;
  if (result.status == GraspForceStatus::kInfeasible) result.y /= y_.cwiseAbs().maxCoeff();
  result.f_c.setZero();
  if (!optimal) return;
  for (Eigen::Index i = 0; i < problem.num_contacts(); ++i) {
    const Vector3d& x = contacts_[static_cast<std::size_t>(i)].x;
    result.f_c.segment<3>(3 * i) << x[1], x[2], x[0] / problem.mu[i];
  }
}

}  // namespace dexcheck::grasp_internal
