// The sampled error dynamics: closed forms against eigenvalues, and against the whole closed loop.

#include "harness/study/sampled_stability.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <string>
#include <vector>

#include "controller/common/text.h"
#include "harness/plant/velocity_filter.h"
#include "harness/run/runner.h"
#include "tests/harness/study/study_fixture.h"

namespace dexcheck::testing::sampled_stability_test {
namespace {

/// One sample built step by step, and the roots of its characteristic polynomial.
double SolveSpectralRadius(const SampledLoop& loop, const AxisGains& gains) {
  const double h = loop.time_step;
  std::array<double, 2> e = {1.0, 0.0};  // of the start's e and e_dot
  std::array<double, 2> e_dot = {0.0, 1.0};
  for (size_t i = 0; i < 2; ++i) {
    const double a = i == 0 ? -gains.K_p : -gains.K_v;
    for (long k = 0; k < loop.hold; ++k) {
      e_dot[i] += h * a;
      e[i] += h * e_dot[i];
    }
  }
  const std::complex<double> half = 0.5 * (e[0] + e_dot[1]);
  const std::complex<double> root = std::sqrt(half * half - (e[0] * e_dot[1] - e[1] * e_dot[0]));
  return std::max(std::abs(half + root), std::abs(half - root));
}

constexpr double kRounding = 1e-12;  // a few operations on numbers of size 1

TEST(SampledStability, SpectralRadiusIsThatOfTheStepsTaken) {
  for (const SampledLoop loop : {SampledLoop{1e-3, 1}, SampledLoop{2e-3, 1}, SampledLoop{1e-3, 7}}) {
    for (const double p : {0.01, 0.3, 1.0, 2.5}) {
      for (const double v : {0.02, 0.5, 1.3, 2.2}) {
        const double T = loop.period();
        const AxisGains gains{p / (T * T), v / T};
        EXPECT_NEAR(CalcSpectralRadius(loop, gains), SolveSpectralRadius(loop, gains), kRounding);
      }
    }
  }
}

/// Open range of K_v that is stable at K_p > 0, 1/s, by Jury's criterion; empty when least >= most.
struct StableRange {
  double least = 0.0;
  double most = 0.0;
};
StableRange CalcStableRange(const SampledLoop& loop, double K_p) {
  const double T = loop.period();
  const double h = loop.time_step;
  return {0.5 * (T - h) * K_p, 2.0 / T - 0.5 * h * K_p};
}

TEST(SampledStability, TheRangeEndsWhereTheRadiusIsOne) {
  constexpr double kStep = 1e-6;  // relative; far above rounding, so that both sides are distinguished
  for (const SampledLoop loop : {SampledLoop{1e-3, 1}, SampledLoop{5e-4, 1}, SampledLoop{1e-3, 10}}) {
    for (const double p : {0.1, 0.5, 1.0}) {
      const double K_p = p / (loop.period() * loop.period());
      const auto range = CalcStableRange(loop, K_p);
      ASSERT_LT(range.least, range.most);
      const auto radius = [&](double K_v) { return CalcSpectralRadius(loop, {K_p, K_v}); };
      EXPECT_LT(radius(range.most * (1.0 - kStep)), 1.0);
      EXPECT_GT(radius(range.most * (1.0 + kStep)), 1.0);
      const double width = kStep * range.most;
      EXPECT_LT(radius(range.least + width), 1.0);
      EXPECT_GT(radius(range.least - width), 1.0);
    }
  }
  // Beyond all K_v.
  const auto none = CalcStableRange({1e-3, 1}, 4.1e6);
  EXPECT_GE(none.least, none.most);
}

constexpr double kCutoff = 60.0;  // Hz, of the object's rate

/// Torques three steps late and a filtered rate; half a step and two measured late; motors that lag.
std::vector<SampledLoop> MakeLateLoops() {
  const double low_pass = CalcLowPassGain(kCutoff, 1e-3);
  return {
      {1e-3, 1, 3e-3, 0, low_pass, 0.0}, {1e-3, 1, 1.5e-3, 2, 1.0, 0.0}, {1e-3, 1, 0.0, 0, low_pass, 2e-3}};
}

/// Frequency w at which K_p = w^2, K_v = 2 w turns unstable.
double FindFrequencyLimit(const SampledLoop& loop) {
  double low = 1.0;
  double high = 2e3;
  for (int i = 0; i < 60; ++i) {
    const double middle = std::sqrt(low * high);
    (CalcSpectralRadius(loop, {middle * middle, 2.0 * middle}) < 1.0 ? low : high) = middle;
  }
  return low;
}

// With d whole steps of delay and V = (a / h) (z - 1) / (z - 1 + a) E the chain has the characteristic
// polynomial
//   z^d (z - 1)^2 (z - 1 + a) + h^2 K_p z (z - 1 + a) + h K_v a z (z - 1),
// which has a root on the unit circle where the radius is one, and none beside.
TEST(SampledStability, ALateLoopTurnsWhereItsPolynomialHasARootOnTheCircle) {
  for (const long d : {0L, 1L, 4L}) {
    for (const double a : {0.3, 0.7}) {
      const double h = 1e-3;
      const SampledLoop loop{h, 1, static_cast<double>(d) * h, 0, a, 0.0};
      const double w = FindFrequencyLimit(loop);
      // Size of the polynomial at an angle, least over the angles: a scan, then a search by thirds.
      const auto least = [&](double frequency) {
        const auto size = [&](double angle) {
          const std::complex<double> z = std::polar(1.0, angle);
          const std::complex<double> filter = z - 1.0 + a;
          std::complex<double> delayed = (z - 1.0) * (z - 1.0) * filter;
          for (long i = 0; i < d; ++i) delayed *= z;
          return std::abs(delayed + h * h * frequency * frequency * z * filter +
                          2.0 * h * frequency * a * z * (z - 1.0));
        };
        constexpr int kAngles = 2000;
        constexpr double kApart = M_PI / kAngles;
        double best = kApart;
        for (int i = 1; i < kAngles; ++i) {
          if (size(kApart * i) < size(best)) best = kApart * i;
        }
        double low = best - kApart;
        double high = best + kApart;
        for (int i = 0; i < 100; ++i) {
          const double third = (high - low) / 3.0;
          if (size(low + third) < size(high - third)) {
            high -= third;
          } else {
            low += third;
          }
        }
        return size(low);
      };
      constexpr double kRoot = 1e-9;  // rounding and the bisection of w
      EXPECT_LT(least(w), kRoot) << d << ", " << a;
      EXPECT_GT(least(0.99 * w), 1e4 * kRoot) << d << ", " << a;
      EXPECT_GT(least(1.01 * w), 1e4 * kRoot) << d << ", " << a;
    }
  }
}

// The matrix of a loop without any lateness has the closed form's radius.
TEST(SampledStability, AChainWithoutLatenessIsTheDirectLoop) {
  constexpr double kTiny = 1e-15;  // s, of a lag: the chain is used, and does nothing
  for (const long hold : {1L, 5L}) {
    for (const AxisGains gains : {AxisGains{400, 40}, AxisGains{1e4, 50}, AxisGains{1e4, 300}}) {
      EXPECT_NEAR(CalcSpectralRadius({1e-3, hold, 0.0, 0, 1.0, kTiny}, gains),
                  CalcSpectralRadius({1e-3, hold}, gains), 1e-9);
    }
  }
}

/// The closed loop of `offset` at these gains.
StudyInputs MakeInputs(const std::vector<std::string>& overrides) {
  StudyInputs inputs =
      MakeStudyInputs("name = \"s\"\nscenario = \"offset\"\n[[vary]]\nkey = \"control.K_v\"\nvalues = [1]\n");
  inputs.study.overrides = overrides;
  return inputs;
}

/// Small enough that wheels and motors can follow the strongest gains.
constexpr double kStartError = 1e-7;  // m

std::vector<std::string> MakeOverrides(const SampledLoop& loop, double K_p, double duration,
                                       double start_error) {
  std::vector<std::string> late;
  if (loop.delay > 0.0) late.push_back("actuation.delay=" + FormatNumber(loop.delay));
  if (loop.latency > 0) {
    late.push_back("sensing.latency=" + FormatNumber(static_cast<double>(loop.latency) * loop.time_step));
  }
  if (loop.lag > 0.0) late.push_back("actuation.lag=" + FormatNumber(loop.lag));
  if (loop.low_pass < 1.0) {
    late.emplace_back("sensing.object_velocity=differenced");
    late.push_back("sensing.object_velocity_cutoff=" + FormatNumber(kCutoff));
  }
  std::vector<std::string> all = {"start_error.xyz=[" + FormatNumber(start_error) + ", 0, 0]",
                                  "plant.time_step=" + FormatNumber(loop.time_step),
                                  "plant.control_step=" + FormatNumber(loop.period()),
                                  "duration=" + FormatNumber(duration),
                                  "settle=0.3",
                                  "control.K_p=" + FormatNumber(K_p)};
  all.insert(all.end(), late.begin(), late.end());
  return all;
}

// What is left is where settling leaves the object, 1e-9 m to 2e-8 m whatever the start error: measured 8e-6
// for torques at every step, 2e-4 for torques that are held.
constexpr double kStep = 1e-4;  // m
constexpr double kAtEveryStep = 5e-5;
constexpr double kHeld = 1e-3;

/// The object's error along x at each step, relative to the start error.
std::vector<double> MeasureResponse(const SampledLoop& loop, const AxisGains& gains, double duration) {
  const StudyInputs inputs = MakeInputs(MakeOverrides(loop, gains.K_p, duration, kStep));
  const Setup setup(MakeTrialScenario(inputs, {0, 0, {gains.K_v}}), inputs.robot, inputs.mjcf);
  Runner runner(setup, /*check=*/false);
  std::vector<double> measured;
  runner.Run([&](const StepRecord& step) { measured.push_back(step.error.position.x() / kStep); },
             [] { return false; });
  EXPECT_EQ(runner.result().failure, "");
  return measured;
}

/// Largest difference of the measured response from that of a predicted sampling.
double MeasureDeparture(const SampledLoop& loop, const AxisGains& gains, const SampledLoop& predicted_loop) {
  const std::vector<double> measured = MeasureResponse(loop, gains, 0.1);
  const std::vector<double> predicted =
      CalcStepResponse(predicted_loop, gains, static_cast<long>(measured.size()));
  EXPECT_GE(measured.size(), 100u);
  double departure = 0.0;
  for (size_t i = 0; i < measured.size(); ++i) {
    departure = std::max(departure, std::abs(measured[i] - predicted[i]));
  }
  return departure;
}

TEST(SampledStability, TheRobotRespondsAsPredicted) {
  EXPECT_LT(MeasureDeparture({1e-3, 1}, {400, 40}, {1e-3, 1}), kAtEveryStep);
  EXPECT_LT(MeasureDeparture({1e-3, 1}, {1e4, 50}, {1e-3, 1}), kAtEveryStep);
  EXPECT_LT(MeasureDeparture({1e-3, 1}, {1e4, 1000}, {1e-3, 1}), kAtEveryStep);
  EXPECT_LT(MeasureDeparture({5e-4, 1}, {400, 40}, {5e-4, 1}), kAtEveryStep);
  EXPECT_LT(MeasureDeparture({1e-3, 4}, {400, 40}, {1e-3, 4}), kHeld);
  EXPECT_LT(MeasureDeparture({1e-3, 10}, {400, 40}, {1e-3, 10}), kHeld);
  // Other samplings are distinguished.
  EXPECT_GT(MeasureDeparture({1e-3, 1}, {1e4, 50}, {1e-3, 2}), 100.0 * kAtEveryStep);
  EXPECT_GT(MeasureDeparture({1e-3, 10}, {400, 40}, {1e-3, 9}), 3.0 * kHeld);
}

Outcome Try(const SampledLoop& loop, const AxisGains& gains) {
  return RunTrial(MakeInputs(MakeOverrides(loop, gains.K_p, 0.2, kStartError)), {0, 0, {gains.K_v}}).outcome;
}

// Where the theory is exact the plant turns over within 2 % of it.
TEST(SampledStability, TheRobotIsStableWhereItIsPredicted) {
  constexpr double kMargin = 0.02;
  for (const double K_p : {1e4, 1e6, 2e6}) {
    const SampledLoop loop{1e-3, 1};
    const double limit = CalcStableRange(loop, K_p).most;
    EXPECT_EQ(Try(loop, {K_p, (1.0 - kMargin) * limit}), Outcome::kTracked) << K_p;
    const Outcome beyond = Try(loop, {K_p, (1.0 + kMargin) * limit});
    EXPECT_TRUE(beyond == Outcome::kDiverged || beyond == Outcome::kLostContact) << NameOf(beyond);
  }
}

// Of the start error; contacts that roll take the late torques a little otherwise than a rigid loop does.
constexpr double kLate = 1e-3;

// Delay, latency, filter and lag: the robot responds as predicted, and turns within 1 % of the predicted
// limit.
TEST(SampledStability, TheRobotIsStableWhereItIsPredictedWithDelayAndFilter) {
  constexpr double kMargin = 0.01;
  for (const SampledLoop& loop : MakeLateLoops()) {
    EXPECT_LT(MeasureDeparture(loop, {900, 60}, loop), kLate);
    EXPECT_GT(MeasureDeparture(loop, {900, 60}, {1e-3, 1}), 10.0 * kLate) << "lateness matters";
    const double limit = FindFrequencyLimit(loop);
    for (const double fraction : {1.0 - kMargin, 1.0 + kMargin}) {
      const double w = fraction * limit;
      const Outcome outcome =
          RunTrial(MakeInputs(MakeOverrides(loop, w * w, 0.6, 1e-6)), {0, 0, {2.0 * w}}).outcome;
      EXPECT_EQ(outcome, fraction < 1.0 ? Outcome::kTracked : Outcome::kDiverged)
          << limit << ", " << fraction;
    }
  }
}

// Metrics of the run against those of the step response: direct and overshooting, and with torques that come
// late.
TEST(Theory, PredictsTheMetricsOfARun) {
  constexpr double kSettling = 3e-3;  // s: the error creeps through the threshold
  for (const SampledLoop& loop : {SampledLoop{1e-3, 1}, SampledLoop{1e-3, 1, 2e-3}}) {
    const StudyInputs inputs = MakeInputs(MakeOverrides(loop, 400.0, 0.6, kStep));
    const std::vector<double> parameters = {16.0};
    const TrialResult measured = RunTrial(inputs, {0, 0, parameters});
    const Theory predicted = CalcTheory(inputs, parameters);
    ASSERT_TRUE(IsHeld(measured.outcome)) << measured.failure;
    for (const Metric metric : {kPositionErrorRms, kPositionErrorMax, kOvershoot, kErrorGrowth}) {
      ASSERT_GT(predicted.metrics[metric], 0.0) << kMetrics[metric].name;
      EXPECT_NEAR(measured.metrics[metric] / predicted.metrics[metric], 1.0, 10.0 * kLate)
          << kMetrics[metric].name;
    }
    EXPECT_NEAR(measured.metrics[kSettlingTime], predicted.metrics[kSettlingTime], kSettling);
    EXPECT_TRUE(std::isnan(predicted.metrics[kEnergy])) << "which (57) does not know";
  }
}

// The integral of the squared error is e0^2 (K_v^2 + K_p) / (2 K_v K_p).
TEST(Theory, TheErrorIsThatOfTheClosedForm) {
  constexpr double kSampling =
      0.02;  // relative: h / 2 beside an integral of 0.05 s, and as much for the steps
  const StudyInputs inputs = MakeInputs(MakeOverrides({1e-3, 1}, 400.0, 2.0, kStep));
  for (const double K_v : {10.0, 20.0, 40.0, 150.0}) {
    const double rms = kStep * std::sqrt((K_v * K_v + 400.0) / (2.0 * K_v * 400.0) / 2.0);
    EXPECT_NEAR(CalcTheory(inputs, {K_v}).metrics[kPositionErrorRms] / rms, 1.0, kSampling) << K_v;
  }
}

TEST(Theory, IsSilentWhereMoreThanTheErrorDynamicsActs) {
  const std::vector<std::string> known = MakeOverrides({1e-3, 1}, 400.0, 0.2, kStep);
  const auto is_known = [&](const std::string& setting, double K_v) {
    std::vector<std::string> overrides = known;
    if (!setting.empty()) overrides.push_back(setting);
    return std::isfinite(CalcTheory(MakeInputs(overrides), {K_v}).metrics[kPositionErrorRms]);
  };
  EXPECT_TRUE(is_known("", 40.0));
  EXPECT_TRUE(is_known("actuation.delay=0.002", 40.0));
  EXPECT_FALSE(is_known("", 3000.0)) << "unstable";
  for (const char* const setting :
       {"start_error.xyz=[0, 0, 0]", "mismatch.mass.object=1.1", "sensing.object_position_noise=1e-5",
        "actuation.coulomb.wheel=0.1", "control.law=pd_gravity"}) {
    EXPECT_FALSE(is_known(setting, 40.0)) << setting;
  }
}

}  // namespace
}  // namespace dexcheck::testing::sampled_stability_test
