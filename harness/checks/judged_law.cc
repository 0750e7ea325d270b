#include "harness/checks/judged_law.h"

#include <algorithm>
#include <cmath>
#include <complex>

#include "harness/checks/check_table.h"
#include "harness/checks/rounding_scales.h"

namespace dexcheck {

double CalcSampledRadius(const ObjectGains& gains, double time_step, long hold, double velocity_age) {
  const double h = static_cast<double>(hold);
  double radius = 0.0;
  for (Eigen::Index i = 0; i < 6; ++i) {
    // u = -(K_v v + K_p e) is held for h steps: v_h = v + h dt u, e_h = e + h dt v + (h dt / 2 + age) h dt u.
    const double b_v = h * time_step;
    const double b_e = 0.5 * h * (h + 2.0 * velocity_age / time_step) * time_step * time_step;
    Matrix2d A;
    A << 1.0 - b_v * gains.K_v[i], -b_v * gains.K_p[i], b_v - b_e * gains.K_v[i], 1.0 - b_e * gains.K_p[i];
    const double half = 0.5 * A.trace();
    const std::complex<double> root = std::sqrt(std::complex<double>(half * half - A.determinant()));
    const double largest = std::max(std::abs(half + root), std::abs(half - root));
    radius = std::max(radius, std::isnan(largest) ? std::numeric_limits<double>::infinity() : largest);
  }
  return std::pow(radius, 1.0 / h);
}

JudgedLaw::JudgedLaw(const Setup& setup)
    : time_step_(setup.scenario().plant.time_step),
      velocity_age_(setup.scenario().plant.velocity_age()),
      hold_(std::max(1L, std::lround(setup.scenario().plant.control_step / time_step_))),
      stands_(!setup.feet().empty()),
      actuation_(setup.model()),
      commanded_(setup.model(), static_cast<int>(setup.fingertips().size())),
      own_factor_(setup.model()) {
  difference_.setZero(setup.model().num_velocities());
  least_ = RoundingScales(setup.model()).CalcLeastForces();
}

double JudgedLaw::CalcTorqueError(const StepRecord& step, const LawTerms& terms, const TreeFactor& factor) {
  factor_ = &factor;
  balanced_ = terms.C_xi + terms.gravity + terms.friction;
  scale_ = std::max({CalcScale(Norm(balanced_)), Norm(least_), std::numeric_limits<double>::min()});
  actuation_.CalcForce(step.command.tau, difference_);
  difference_ -= force();
  const double error = Norm(difference_) / scale_ / condition_number();
  // Less is rounding, which says nothing.
  differs_ = error > kLawTorqueBound;
  if (differs_) CalcParts(step, terms);
  return error;
}

double JudgedLaw::CompareTorque(const StepRecord& step, const LawTerms& terms) {
  own_factor_.Compute(terms.M);
  if (!Evaluate(step, terms)) return std::numeric_limits<double>::infinity();
  return CalcTorqueError(step, terms, own_factor_);
}

}  // namespace dexcheck
