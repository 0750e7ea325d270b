#pragma once

// Two-sided bounds in the interior-point method. Internal to controller/grasp.

#include <algorithm>
#include <type_traits>

namespace dexcheck::grasp_internal {

/// Bounds lower <= v <= upper on a scalar (T = double) or on one scalar per contact (T = Lanes): the slacks
/// v - lower and upper - v, their multipliers, and the part of the search direction that belongs to them.
/// Complementarity asks slack_lower * z_lower = slack_upper * z_upper = target.
template <class T>
class BoxBounds {
 public:
  T slack_lower, slack_upper;
  T z_lower, z_upper;

  void SetValue(const T& value, const T& lower, const T& upper) {
    slack_lower = value - lower;
    slack_upper = upper - value;
  }

  T CalcGap() const { return slack_lower * z_lower + slack_upper * z_upper; }

  /// Upper bound on target * sum (t - 1 - log t), t = slack * z / target: what these bounds add to the
  /// duality gap of the barrier problem, since t - 1 - log t <= (t - 1)^2 / t.
  T CalcBarrierGap(double target) const {
    const T t_lower = slack_lower * z_lower / target;
    const T t_upper = slack_upper * z_upper / target;
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
  T curvature() const { return curvature_lower_ + curvature_upper_; }

  /// Aims the step at slack * z = target.
  void Aim(double target) {
    z_aim_lower_ = target * inv_slack_lower_;
    z_aim_upper_ = target * inv_slack_upper_;
  }

  /// The same with Mehrotra's second-order correction from the direction last set, in which v moved by dv.
  void AimCorrected(double target, const T& dv) {
    z_aim_lower_ = (target - dv * dz_lower_) * inv_slack_lower_;
    z_aim_upper_ = (target + dv * dz_upper_) * inv_slack_upper_;
  }

  /// d(z_lower - z_upper) at dv = 0.
  T CalcPull() const { return (z_aim_lower_ - z_lower) - (z_aim_upper_ - z_upper); }

  /// dz from the linearised complementarity z dslack + slack dz = aim - slack z.
  void SetDirection(const T& dv) {
    dz_lower_ = z_aim_lower_ - z_lower - curvature_lower_ * dv;
    dz_upper_ = z_aim_upper_ - z_upper + curvature_upper_ * dv;
  }

  /// d(z_lower - z_upper) of the direction last set.
  T CalcMultiplierStep() const { return dz_lower_ - dz_upper_; }

  /// Inverse of the longest step that keeps the slacks positive.
  T CalcInversePrimalStep(const T& dv) const { return Max(-dv * inv_slack_lower_, dv * inv_slack_upper_); }

  /// Inverse of the longest step that keeps slacks and multipliers positive.
  T CalcInverseStep(const T& dv) const {
    return Max(CalcInversePrimalStep(dv), Max(-dz_lower_ / z_lower, -dz_upper_ / z_upper));
  }

  /// Moves v alone.
  void AdvanceValue(const T& dv) {
    slack_lower += dv;
    slack_upper -= dv;
  }

  void Advance(double step, const T& dv) {
    slack_lower += step * dv;
    slack_upper -= step * dv;
    z_lower += step * dz_lower_;
    z_upper += step * dz_upper_;
  }

 private:
  // Arguments may be unevaluated Eigen expressions.
  template <class A, class B>
  static T Max(const A& a, const B& b) {
    if constexpr (std::is_same_v<T, double>) {
      return std::max<double>(a, b);
    } else {
      return a.max(b);
    }
  }

  T inv_slack_lower_, inv_slack_upper_;
  T curvature_lower_, curvature_upper_;
  T z_aim_lower_, z_aim_upper_;
  T dz_lower_, dz_upper_;
};

}  // namespace dexcheck::grasp_internal
