#include "harness/study/sampled_stability.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "harness/plant/velocity_filter.h"
#include "harness/study/trial.h"

namespace dexcheck {

namespace {

/// b = (T^2 + h T) / 2: what e gains from an acceleration that is held.
double CalcReach(const SampledLoop& loop) { return 0.5 * loop.period() * (loop.period() + loop.time_step); }

/// One axis of the error, stepped as the plant, its sensors and its motors step it. It is linear in its
/// state.
class ErrorChain {
 public:
  ErrorChain(const SampledLoop& loop, const AxisGains& gains) : loop_(loop), gains_(gains) {
    // As motors mix the torques of two steps where the delay is no whole number of them.
    constexpr double kRounding = 1e-9;
    const double steps = loop.delay / loop.time_step;
    const double whole = std::floor(steps + kRounding * std::max(1.0, steps));
    fraction_ = std::max(0.0, steps - whole);
    if (fraction_ < kRounding * std::max(1.0, steps)) fraction_ = 0.0;
    late_ = static_cast<size_t>(whole);
    const auto latency = static_cast<size_t>(loop.latency);
    size_ = kChains + 2 * latency + (loop.is_direct() ? 0 : late_ + 1);
    state_.assign(size_, 0.0);
  }

  [[nodiscard]] size_t size() const { return size_; }
  [[nodiscard]] std::vector<double>& state() { return state_; }
  [[nodiscard]] double error() const { return state_[kError]; }

  /// At rest beside the place that it is called to; nothing was sent before.
  void Start(double error) {
    std::fill(state_.begin(), state_.end(), 0.0);
    state_[kError] = state_[kSeen] = error;
    for (size_t i = 0; i < static_cast<size_t>(loop_.latency); ++i) state_[kChains + 2 * i] = error;
  }

  /// Step k of the period.
  void Step(long k) {
    const double h = loop_.time_step;
    double& e = state_[kError];
    double& e_dot = state_[kRate];
    // The rate is differenced: (e_k - e_{k-1}) / h, which is e_dot where the filter lets all through.
    state_[kFiltered] += loop_.low_pass * ((e - state_[kSeen]) / h - state_[kFiltered]);
    state_[kSeen] = e;
    double measured = e;
    double measured_rate = loop_.low_pass == 1.0 ? e_dot : state_[kFiltered];
    for (size_t i = 0; i < static_cast<size_t>(loop_.latency); ++i) {
      std::swap(measured, state_[kChains + 2 * i]);
      std::swap(measured_rate, state_[kChains + 2 * i + 1]);
    }
    if (k % loop_.hold == 0) state_[kHeld] = -gains_.K_v * measured_rate - gains_.K_p * measured;
    double a = state_[kHeld];
    if (!loop_.is_direct()) a = Lag(Delay(a));
    e_dot += h * a;
    e += h * e_dot;
  }

 private:
  enum Place : size_t { kError, kRate, kSeen, kFiltered, kHeld, kLagging, kChains };

  /// The chain of what was sent holds late_ + 1 steps, the newest first.
  double Delay(double a) {
    const size_t first = size_ - late_ - 1;
    double newest = a;
    for (size_t i = 0; i < late_; ++i) std::swap(newest, state_[first + i]);
    // `newest` was sent late_ steps ago, the last place holds what was sent one step earlier.
    const double earlier = state_[first + late_];
    state_[first + late_] = newest;
    return (1.0 - fraction_) * newest + fraction_ * earlier;
  }

  /// y' = (u - y) / lag, its mean over the step.
  double Lag(double u) {
    if (!(loop_.lag > 0.0)) {
      state_[kLagging] = 0.0;  // a state that stays as it is would be an eigenvalue of 1
      return u;
    }
    const double away = state_[kLagging] - u;
    const double decay = std::exp(-loop_.time_step / loop_.lag);
    state_[kLagging] = u + away * decay;
    return u + away * (1.0 - decay) * loop_.lag / loop_.time_step;
  }

  SampledLoop loop_;
  AxisGains gains_;
  size_t late_ = 0;
  double fraction_ = 0.0;
  size_t size_ = 0;
  std::vector<double> state_;
};

/// lim |A^n|^(1/n) of a matrix by columns; n is doubled until its root no longer moves by more than rounding.
double CalcSpectralRadiusOf(std::vector<double> A, size_t n) {
  constexpr int kSquarings = 40;
  double logarithm = 0.0;  // of the power's size, divided by the power
  double fraction = 1.0;
  std::vector<double> square(n * n);
  for (int i = 0; i <= kSquarings; ++i) {
    double size = 0.0;
    for (const double entry : A) size = std::max(size, std::abs(entry));
    if (!(size > 0.0)) return 0.0;
    logarithm += fraction * std::log(size);
    fraction *= 0.5;
    for (double& entry : A) entry /= size;
    std::fill(square.begin(), square.end(), 0.0);
    for (size_t column = 0; column < n; ++column) {
      for (size_t k = 0; k < n; ++k) {
        const double factor = A[column * n + k];
        if (factor == 0.0) continue;
        for (size_t row = 0; row < n; ++row) square[column * n + row] += A[k * n + row] * factor;
      }
    }
    A.swap(square);
  }
  return std::exp(logarithm);
}

double CalcRadiusOfChain(const SampledLoop& loop, const AxisGains& gains) {
  ErrorChain chain(loop, gains);
  const size_t n = chain.size();
  std::vector<double> A(n * n, 0.0);
  for (size_t column = 0; column < n; ++column) {
    chain.state().assign(n, 0.0);
    chain.state()[column] = 1.0;
    for (long k = 0; k < loop.hold; ++k) chain.Step(k);
    std::copy(chain.state().begin(), chain.state().end(),
              A.begin() + static_cast<std::ptrdiff_t>(column * n));
  }
  return CalcSpectralRadiusOf(std::move(A), n);
}

}  // namespace

double CalcSpectralRadius(const SampledLoop& loop, const AxisGains& gains) {
  if (!loop.is_direct()) return CalcRadiusOfChain(loop, gains);
  const double T = loop.period();
  const double b = CalcReach(loop);
  const double trace = 2.0 - T * gains.K_v - b * gains.K_p;
  const double determinant = 1.0 - T * gains.K_v + (T * T - b) * gains.K_p;
  const double discriminant = 0.25 * trace * trace - determinant;
  if (discriminant < 0.0) return std::sqrt(determinant);
  return 0.5 * std::abs(trace) + std::sqrt(discriminant);
}

std::vector<double> CalcStepResponse(const SampledLoop& loop, const AxisGains& gains, long count) {
  ErrorChain chain(loop, gains);
  chain.Start(1.0);
  std::vector<double> errors;
  for (long i = 0; i < count; ++i) {
    errors.push_back(chain.error());
    chain.Step(i);
  }
  return errors;
}

namespace {

/// The faults of sensing and motors that all axes have alike.
SampledLoop MakeLoop(const Scenario& scenario) {
  SampledLoop loop;
  loop.time_step = scenario.plant.time_step;
  loop.hold = std::max(1L, std::lround(scenario.plant.control_step / scenario.plant.time_step));
  const SensingOptions& sensing = scenario.imperfections.sensing;
  const ActuationOptions& actuation = scenario.imperfections.actuation;
  loop.delay = actuation.delay;
  loop.latency =
      CountSteps(sensing.latency, loop.time_step) + CountSteps(sensing.object_latency, loop.time_step);
  if (sensing.object_velocity == VelocitySource::kDifferenced) {
    loop.low_pass = CalcLowPassGain(sensing.object_velocity_cutoff, loop.time_step);
  }
  if (actuation.lag.groups.empty()) loop.lag = actuation.lag.all;
  return loop;
}

AxisGains GainsOf(const Scenario& scenario, int axis) {
  return {scenario.control.gains.K_p[axis], scenario.control.gains.K_v[axis]};
}

/// Whether the object's position follows (57), with what MakeLoop takes into account and nothing besides.
bool FollowsErrorDynamics(const Scenario& scenario) {
  Imperfections rest = scenario.imperfections;
  rest.actuation.delay = rest.actuation.lag.all = 0.0;
  rest.actuation.saturate = false;
  rest.sensing.latency = rest.sensing.object_latency = 0.0;
  if (rest.sensing.object_velocity == VelocitySource::kDifferenced) {
    rest.sensing.object_velocity = VelocitySource::kMeasured;
    rest.sensing.object_velocity_cutoff = 0.0;
  }
  return rest.is_ideal() && scenario.control.law == ControlLaw::kComputedTorque &&
         scenario.control.contact_error == 0.0 && scenario.trajectory_task() != nullptr &&
         scenario.start_error().head<3>().norm() > 0.0;
}

/// Metrics of the object's position, as TrialMonitor has them; of a loop that is stable.
void PredictMetrics(const Scenario& scenario, const SampledLoop& loop,
                    std::array<double, kNumMetrics>* metrics) {
  const auto steps = static_cast<size_t>(std::lround(scenario.duration / loop.time_step));
  const Vector3d start = scenario.start_error().head<3>();
  std::vector<Vector3d> errors(steps, Vector3d::Zero());
  for (int axis = 0; axis < 3; ++axis) {
    if (start[axis] == 0.0) continue;
    const std::vector<double> response =
        CalcStepResponse(loop, GainsOf(scenario, axis), static_cast<long>(steps));
    for (size_t k = 0; k < steps; ++k) errors[k][axis] = start[axis] * response[k];
  }
  double squares = 0.0, largest = 0.0, overshoot = 0.0, settled_since = 0.0;
  std::array<double, 4> quarters{};
  bool settled = false;
  for (size_t k = 0; k < steps; ++k) {
    const double size = errors[k].norm();
    squares += size * size;
    quarters[4 * k / steps] += size * size;
    largest = std::max(largest, size);
    overshoot = std::max(overshoot, -errors[k].dot(start) / start.squaredNorm());
    const bool inside = size <= kSettledFraction * start.norm();
    if (inside && !settled) settled_since = static_cast<double>(k) * loop.time_step;
    settled = inside;
  }
  (*metrics)[kPositionErrorRms] = std::sqrt(squares / static_cast<double>(steps));
  (*metrics)[kPositionErrorMax] = largest;
  if (settled) (*metrics)[kSettlingTime] = settled_since;
  (*metrics)[kOvershoot] = overshoot;
  (*metrics)[kErrorGrowth] = std::sqrt(quarters[3] / quarters[0]);
}

}  // namespace

Theory CalcTheory(const StudyInputs& inputs, const std::vector<double>& parameters) {
  Theory theory;
  theory.metrics.fill(std::numeric_limits<double>::quiet_NaN());
  const Scenario scenario = MakeTrialScenario(inputs, {0, 0, parameters});
  const SampledLoop loop = MakeLoop(scenario);
  for (int axis = 0; axis < 6; ++axis) {
    if (axis > 0 && GainsOf(scenario, axis) == GainsOf(scenario, axis - 1)) continue;
    theory.radius = std::max(theory.radius, CalcSpectralRadius(loop, GainsOf(scenario, axis)));
  }
  if (theory.is_stable() && FollowsErrorDynamics(scenario)) PredictMetrics(scenario, loop, &theory.metrics);
  return theory;
}

}  // namespace dexcheck
