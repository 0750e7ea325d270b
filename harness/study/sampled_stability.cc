#include "harness/study/sampled_stability.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/checks/judged_law.h"
#include "harness/plant/velocity_filter.h"
#include "harness/run/joint_margins.h"

namespace dexcheck {

namespace {

/// One axis of the error is a plant of mass 1.
LinearLoop MakeAxis(const SampledLoop& timing, const AxisGains& gains) {
  const MatrixXd one = MatrixXd::Identity(1, 1);
  return {
      .timing = timing, .M = one, .D = 0.0 * one, .G = 0.0 * one, .K = gains.K_p * one, .V = gains.K_v * one};
}

/// lim |A^n|^(1/n); n is doubled until its root no longer moves by more than rounding.
double CalcSpectralRadiusOf(MatrixXd A) {
  constexpr int kSquarings = 40;
  double logarithm = 0.0;  // of the power's size, divided by the power
  double fraction = 1.0;
  for (int i = 0; i <= kSquarings; ++i) {
    const double size = A.cwiseAbs().maxCoeff();
    if (!(size > 0.0)) return 0.0;
    logarithm += fraction * std::log(size);
    fraction *= 0.5;
    A /= size;
    A = (A * A).eval();
  }
  return std::exp(logarithm);
}

}  // namespace

double CalcSpectralRadius(const SampledLoop& loop, const AxisGains& gains) {
  if (loop.is_direct()) {
    const ObjectGains alike{Vector6d::Constant(gains.K_v), Vector6d::Constant(gains.K_p)};
    const double of_step = CalcSampledRadius(alike, loop.time_step, loop.hold, 0.5 * loop.time_step);
    return std::pow(of_step, static_cast<double>(loop.hold));
  }
  const SampledSystem system = CalcSampledSystem(MakeAxis(loop, gains));
  return CalcSpectralRadiusOf(system.A - system.B * system.C);
}

std::vector<double> CalcStepResponse(const SampledLoop& loop, const AxisGains& gains, long count) {
  const LoopChain chain(MakeAxis(loop, gains));
  // At rest beside the place that it is called to; nothing was sent before.
  MatrixXd x = MatrixXd::Zero(chain.size(), 1), c = MatrixXd::Zero(1, 1);
  x(0, 0) = 1.0;
  for (long i = 0; i < loop.latency; ++i) x(4 + 2 * i, 0) = 1.0;
  std::vector<double> errors;
  for (long i = 0; i < count; ++i) {
    errors.push_back(x(0, 0));
    const MatrixXd law = chain.Measure(&x);
    if (i % loop.hold == 0) c = -law;
    chain.Move(c, &x);
  }
  return errors;
}

namespace {

/// The faults of sensing and motors that all axes have alike.
SampledLoop MakeLoop(const Scenario& scenario) {
  SampledLoop loop = FindTiming(scenario);
  const SensingOptions& sensing = scenario.imperfections.sensing;
  const ActuationOptions& actuation = scenario.imperfections.actuation;
  loop.latency += CountSteps(sensing.object_latency, loop.time_step);
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
  rest.actuation.limit = {};
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
