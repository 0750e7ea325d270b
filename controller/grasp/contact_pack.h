#pragma once

// Four contacts in the interior-point method: what concerns each contact alone. Internal to controller/grasp.

#include <Eigen/Core>
#include <array>
#include <cstddef>

namespace dexcheck::grasp_internal {

inline constexpr int kLanes = 4;

/// One number for each of four contacts.
using Lanes = Eigen::Array<double, kLanes, 1>;

/// One vector (x0, x1, x2) for each of four contacts.
using Lanes3 = std::array<Lanes, 3>;

inline Lanes3 ZeroLanes3() { return {Lanes::Zero(), Lanes::Zero(), Lanes::Zero()}; }

inline Lanes CalcDot(const Lanes3& a, const Lanes3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// a^T J b with J = diag(1, -1, -1). det x = x^T J x is positive inside the cone {x0 >= |(x1, x2)|}.
inline Lanes CalcDotJ(const Lanes3& a, const Lanes3& b) { return a[0] * b[0] - a[1] * b[1] - a[2] * b[2]; }

/// Inverse of the longest step along `d` that stays in the cone, from an interior point x with 1/det x given;
/// not positive if no step leaves it.
inline Lanes CalcInverseConeStep(const Lanes3& x, const Lanes& inv_det, const Lanes3& d) {
  // det(x + d / beta) = 0  <=>  beta^2 + 2 p beta + q = 0,  p = x^T J d / det x,  q = det d / det x.
  const Lanes p = CalcDotJ(x, d) * inv_det;
  const Lanes q = CalcDotJ(d, d) * inv_det;
  return (p * p - q).max(0.0).sqrt() - p;
}

/// Bounds lower <= v <= upper on one scalar of each contact: the slacks v - lower and upper - v, their
/// multipliers, and the part of the search direction that belongs to them. Complementarity requires
/// slack_lower * z_lower = slack_upper * z_upper = target.
class Bounds {
 public:
  Lanes slack_lower, slack_upper;
  Lanes z_lower, z_upper;

  void SetValue(const Lanes& value, const Lanes& lower, const Lanes& upper) {
    slack_lower = value - lower;
    slack_upper = upper - value;
  }

  Lanes CalcGap() const { return slack_lower * z_lower + slack_upper * z_upper; }

  /// Upper bound on target * sum (t - 1 - log t), t = slack * z / target: what these bounds add to the
  /// duality gap of the barrier problem, since t - 1 - log t <= (t - 1)^2 / t.
  Lanes CalcBarrierGap(double target) const {
    const Lanes t_lower = slack_lower * z_lower / target;
    const Lanes t_upper = slack_upper * z_upper / target;
    return target *
           ((t_lower - 1.0) * (t_lower - 1.0) / t_lower + (t_upper - 1.0) * (t_upper - 1.0) / t_upper);
  }

  /// Prepares the Newton step from the present slacks and multipliers.
  void CalcScaling() {
    inv_slack_lower_ = 1.0 / slack_lower;
    inv_slack_upper_ = 1.0 / slack_upper;
    curvature_lower_ = z_lower * inv_slack_lower_;
    curvature_upper_ = z_upper * inv_slack_upper_;
  }

  /// Curvature that the bounds add to v in the Newton step.
  Lanes curvature() const { return curvature_lower_ + curvature_upper_; }

  /// Aims the step at slack * z = target.
  void Aim(double target) {
    z_aim_lower_ = target * inv_slack_lower_;
    z_aim_upper_ = target * inv_slack_upper_;
  }

  /// The same with Mehrotra's second-order correction from the direction last set, in which v moved by dv.
  void AimCorrected(double target, const Lanes& dv) {
    z_aim_lower_ = (target - dv * dz_lower_) * inv_slack_lower_;
    z_aim_upper_ = (target + dv * dz_upper_) * inv_slack_upper_;
  }

  /// d(z_lower - z_upper) at dv = 0.
  Lanes CalcFreeMultiplierStep() const { return (z_aim_lower_ - z_lower) - (z_aim_upper_ - z_upper); }

  /// dz from the linearised complementarity z dslack + slack dz = aim - slack z.
  void SetDirection(const Lanes& dv) {
    dz_lower_ = z_aim_lower_ - z_lower - curvature_lower_ * dv;
    dz_upper_ = z_aim_upper_ - z_upper + curvature_upper_ * dv;
  }

  /// d(z_lower - z_upper) of the direction last set.
  Lanes CalcMultiplierStep() const { return dz_lower_ - dz_upper_; }

  /// Inverse of the longest step that keeps slacks and multipliers positive.
  Lanes CalcInverseStep(const Lanes& dv) const {
    const Lanes primal = (-dv * inv_slack_lower_).max(dv * inv_slack_upper_);
    return primal.max((-dz_lower_ / z_lower).max(-dz_upper_ / z_upper));
  }

  void Advance(double step, const Lanes& dv) {
    slack_lower += step * dv;
    slack_upper -= step * dv;
    z_lower += step * dz_lower_;
    z_upper += step * dz_upper_;
  }

 private:
  Lanes inv_slack_lower_, inv_slack_upper_;
  Lanes curvature_lower_, curvature_upper_;
  Lanes z_aim_lower_, z_aim_upper_;
  Lanes dz_lower_, dz_upper_;
};

/// Problem data, iterate, scaling and search direction of four contacts in the coordinates x = (mu f3, f1,
/// f2), in which the friction cone (21) is K = {x0 >= |(x1, x2)|}; s in K is the multiplier of the cone, e =
/// (1, 0, 0). A lane without a contact has no column in the equality constraints and no cost, and stays at
/// the centre of its own box.
///
/// W is the Nesterov-Todd scaling: symmetric, with W s = W^-1 x = lambda. With d the curvature of the bounds
/// on x0, the Newton equations of one contact are (I + d u u^T) dx_scaled = aim + pull u + W (A^T dy -
/// dual_residual) and ds_scaled = aim - dx_scaled, with u = W e and dx = W dx_scaled. R = (I + d u
/// u^T)^(-1/2).
class ContactPack {
 public:
  // The problem.
  Lanes mu = Lanes::Ones();
  Lanes w = Lanes::Zero();  // cost of x0
  Lanes lower = Lanes::Zero();
  Lanes upper = Lanes::Ones();

  // The iterate.
  Lanes3 x, s;
  Bounds bounds;         // of x0
  Lanes3 dual_residual;  // w e - A^T y - s - (z_lower - z_upper) e

  // The scaling and the direction, for the constraint rows.
  std::array<Lanes3, 3> K;  // W R, by rows
  Lanes3 dx;

  void SetCenter(double target);
  void CalcScaling();
  void Aim(double target);
  void AimCorrected(double target);
  Lanes3 CalcFreeDirection() const;
  Lanes SetDirection(const Lanes3& g);
  Lanes CalcBarrierGap(double rho) const;
  Lanes CalcSupport(const Lanes3& g) const;

 private:
  Lanes3 lambda_;
  Lanes inv_det_lambda_;
  Lanes3 u_;       // W e
  Lanes eta_;      // (det x / det s)^(1/4)
  Lanes v1_, v2_;  // W = [u0, u1, u2; u1, eta + u1 v1, u1 v2; u2, u2 v1, eta + u2 v2]
  Lanes r_;        // R = I + r u u^T
  Lanes3 aim_;     // dx_scaled + ds_scaled
  Lanes3 dx_scaled_, ds_scaled_;
};

/// The cone's axis at the middle of the bounds, with multipliers that satisfy the dual equation for y = 0: x
/// o s = 2 target e, slack_lower z_lower = target, and slack_upper z_upper >= target if 4 target >= w (lower
/// + upper).
inline void ContactPack::SetCenter(double target) {
  const Lanes mid = 0.5 * (lower + upper);
  x = {mid, Lanes::Zero(), Lanes::Zero()};
  s = {2.0 * target / mid, Lanes::Zero(), Lanes::Zero()};
  bounds.SetValue(mid, lower, upper);
  bounds.z_lower = target / bounds.slack_lower;
  bounds.z_upper = s[0] + bounds.z_lower - w;
}

/// W, R and K = W R at the present iterate.
inline void ContactPack::CalcScaling() {
  // u = W e = (x + eta^2 J s) / sqrt(2 (k + x^T s)),  k = sqrt(det x det s) = det lambda,  eta^2 = det x / k.
  const Lanes det_x = CalcDotJ(x, x);
  const Lanes det_lambda = (det_x * CalcDotJ(s, s)).sqrt();
  inv_det_lambda_ = det_lambda.inverse();
  const Lanes eta_squared = det_x * inv_det_lambda_;
  eta_ = eta_squared.sqrt();
  const Lanes sum = det_lambda + CalcDot(x, s);
  const Lanes root = (2.0 * sum).sqrt().inverse();
  u_ = {(x[0] + eta_squared * s[0]) * root, (x[1] - eta_squared * s[1]) * root,
        (x[2] - eta_squared * s[2]) * root};

  // W = [u0, ut^T; ut, eta I + ut v^T],  v = ut / (eta + u0),  lambda = W s.
  const Lanes inv_v = (eta_ + u_[0]).inverse();
  v1_ = u_[1] * inv_v;
  v2_ = u_[2] * inv_v;
  const Lanes v_s = s[0] + v1_ * s[1] + v2_ * s[2];
  lambda_ = {sum * root, eta_ * s[1] + u_[1] * v_s, eta_ * s[2] + u_[2] * v_s};

  // R = I + r u u^T,  r = -d / (q (1 + q)),  q = sqrt(1 + d |u|^2),  R u = u / q.
  bounds.CalcScaling();
  const Lanes d = bounds.curvature();
  const Lanes q = (1.0 + d * CalcDot(u_, u_)).sqrt();
  const Lanes inv_q_1q = (q * (1.0 + q)).inverse();
  r_ = -d * inv_q_1q;

  // K = W + r (W u) u^T with W u = (|u|^2, 2 u0 ut); its first row is (R u)^T.
  const Lanes inv_q = (1.0 + q) * inv_q_1q;
  const Lanes twice = 2.0 * u_[0] * r_;
  const Lanes t1 = twice * u_[1];
  const Lanes t2 = twice * u_[2];
  const Lanes K12 = u_[1] * (v2_ + t2);
  K[0] = {u_[0] * inv_q, u_[1] * inv_q, u_[2] * inv_q};
  K[1] = {u_[1] + t1 * u_[0], eta_ + u_[1] * (v1_ + t1), K12};
  K[2] = {u_[2] + t2 * u_[0], K12, eta_ + u_[2] * (v2_ + t2)};
}

/// Aims the Newton step at x o s = 2 target e and slack z = target.
inline void ContactPack::Aim(double target) {
  // aim = lambda \ (2 target e - lambda o lambda) = 2 target J lambda / det lambda - lambda.
  const Lanes ratio = 2.0 * target * inv_det_lambda_;
  aim_ = {(ratio - 1.0) * lambda_[0], -(ratio + 1.0) * lambda_[1], -(ratio + 1.0) * lambda_[2]};
  bounds.Aim(target);
}

/// The same with Mehrotra's second-order correction from the direction last set.
inline void ContactPack::AimCorrected(double target) {
  // aim = lambda \ (2 target e - dx_scaled o ds_scaled) - lambda.
  const Lanes3& dx_s = dx_scaled_;
  const Lanes3& ds_s = ds_scaled_;
  const Lanes3 rhs = {2.0 * target - CalcDot(dx_s, ds_s), -(dx_s[0] * ds_s[1] + ds_s[0] * dx_s[1]),
                      -(dx_s[0] * ds_s[2] + ds_s[0] * dx_s[2])};
  const Lanes first = CalcDotJ(lambda_, rhs) * inv_det_lambda_;
  const Lanes inv_lambda0 = lambda_[0].inverse();
  aim_ = {first - lambda_[0], (rhs[1] - first * lambda_[1]) * inv_lambda0 - lambda_[1],
          (rhs[2] - first * lambda_[2]) * inv_lambda0 - lambda_[2]};
  bounds.AimCorrected(target, dx[0]);
}

/// R^-1 dx_scaled for dy = 0.
inline Lanes3 ContactPack::CalcFreeDirection() const {
  // R (aim + pull u - W dual_residual), with R u = K^T e taken whole: pull u is large and R all but cancels
  // it.
  const Lanes3& g = dual_residual;
  const Lanes v_g = g[0] + v1_ * g[1] + v2_ * g[2];
  Lanes3 h = {aim_[0] - CalcDot(u_, g), aim_[1] - v_g * u_[1] - eta_ * g[1],
              aim_[2] - v_g * u_[2] - eta_ * g[2]};
  const Lanes along = r_ * CalcDot(u_, h);
  const Lanes pull = bounds.CalcFreeMultiplierStep();
  for (std::size_t j = 0; j < 3; ++j) h[j] += along * u_[j] + pull * K[0][j];
  return h;
}

/// Sets the direction from g = R^-1 dx_scaled; returns the inverse of the longest step that stays inside.
inline Lanes ContactPack::SetDirection(const Lanes3& g) {
  const Lanes along = r_ * CalcDot(u_, g);
  for (std::size_t j = 0; j < 3; ++j) {
    dx[j] = CalcDot(K[j], g);
    dx_scaled_[j] = g[j] + along * u_[j];
    ds_scaled_[j] = aim_[j] - dx_scaled_[j];
  }
  bounds.SetDirection(dx[0]);
  return bounds.CalcInverseStep(dx[0])
      .max(CalcInverseConeStep(lambda_, inv_det_lambda_, dx_scaled_))
      .max(CalcInverseConeStep(lambda_, inv_det_lambda_, ds_scaled_));
}

/// What the contact adds, at most, to the distance of the barrier objective from its optimum. With t1, t2 the
/// eigenvalues of x o s / (2 rho), t1 + t2 = x^T s / rho and t1 t2 = det x det s / (2 rho)^2, that is rho sum
/// (t - 1 - log t), and t - 1 - log t <= (t - 1)^2 / t.
inline Lanes ContactPack::CalcBarrierGap(double rho) const {
  const Lanes sum = CalcDot(x, s) / rho;
  const Lanes product = CalcDotJ(x, x) * CalcDotJ(s, s) / (4.0 * rho * rho);
  return rho * (sum - 4.0 + sum / product) + bounds.CalcBarrierGap(rho);
}

/// max g^T x over {x in K, lower <= x0 <= upper} = max(lower h, upper h), h = g0 + |(g1, g2)|.
inline Lanes ContactPack::CalcSupport(const Lanes3& g) const {
  const Lanes h = g[0] + (g[1] * g[1] + g[2] * g[2]).sqrt();
  return (lower * h).max(upper * h);
}

}  // namespace dexcheck::grasp_internal
