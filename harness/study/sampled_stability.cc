#include "harness/study/sampled_stability.h"

#include <cmath>

namespace dexcheck {
namespace {

/// b = (T^2 + h T) / 2: what e gains from an acceleration that is held.
double CalcReach(const SampledLoop& loop) { return 0.5 * loop.period() * (loop.period() + loop.time_step); }

}  // namespace

StableRange CalcStableRange(const SampledLoop& loop, double K_p) {
  const double T = loop.period();
  const double h = loop.time_step;
  return {0.5 * (T - h) * K_p, 2.0 / T - 0.5 * h * K_p};
}

double CalcCriticalDamping(const SampledLoop& loop, double K_p) {
  return 2.0 * std::sqrt(K_p) - CalcReach(loop) / loop.period() * K_p;
}

double CalcSpectralRadius(const SampledLoop& loop, const AxisGains& gains) {
  const double T = loop.period();
  const double b = CalcReach(loop);
  const double trace = 2.0 - T * gains.K_v - b * gains.K_p;
  const double determinant = 1.0 - T * gains.K_v + (T * T - b) * gains.K_p;
  const double discriminant = 0.25 * trace * trace - determinant;
  if (discriminant < 0.0) return std::sqrt(determinant);
  return 0.5 * std::abs(trace) + std::sqrt(discriminant);
}

std::vector<double> CalcStepResponse(const SampledLoop& loop, const AxisGains& gains, long count) {
  std::vector<double> errors;
  double e = 1.0;
  double e_dot = 0.0;
  double a = 0.0;
  for (long i = 0; i < count; ++i) {
    errors.push_back(e);
    if (i % loop.hold == 0) a = -gains.K_v * e_dot - gains.K_p * e;
    e_dot += loop.time_step * a;
    e += loop.time_step * e_dot;
  }
  return errors;
}

}  // namespace dexcheck
