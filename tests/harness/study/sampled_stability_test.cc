// The sampled error dynamics: closed forms against eigenvalues, and against the whole closed loop.

#include "harness/study/sampled_stability.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "controller/common/text.h"
#include "controller/common/toml_reader.h"
#include "harness/run/runner.h"
#include "harness/study/trial.h"
#include "tests/common/paths.h"

namespace dexcheck {
namespace {

const std::string kFolder = testing::SourcePath("/harness/shipped/scenarios");

/// One sample built step by step, and its spectral radius by a solver.
double SolveSpectralRadius(const SampledLoop& loop, const AxisGains& gains) {
  const double h = loop.time_step;
  const Eigen::RowVector2d a(-gains.K_p, -gains.K_v);
  Eigen::Matrix2d held = Eigen::Matrix2d::Identity();
  for (long i = 0; i < loop.hold; ++i) {
    held.row(1) += h * a;
    held.row(0) += h * held.row(1);
  }
  return Eigen::EigenSolver<Eigen::Matrix2d>(held).eigenvalues().cwiseAbs().maxCoeff();
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

TEST(SampledStability, TheRangeEndsWhereTheRadiusIsOne) {
  constexpr double kStep = 1e-6;  // relative; far above rounding, so that both sides are told apart
  for (const SampledLoop loop : {SampledLoop{1e-3, 1}, SampledLoop{5e-4, 1}, SampledLoop{1e-3, 10}}) {
    for (const double p : {0.1, 0.5, 1.0}) {
      const double K_p = p / (loop.period() * loop.period());
      const StableRange range = CalcStableRange(loop, K_p);
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
  const StableRange none = CalcStableRange({1e-3, 1}, 4.1e6);
  EXPECT_GE(none.least, none.most);
}

TEST(SampledStability, CriticalDampingIsFastest) {
  for (const SampledLoop loop : {SampledLoop{1e-3, 1}, SampledLoop{1e-3, 10}}) {
    const double K_p = 0.04 / (loop.period() * loop.period());
    const double K_v = CalcCriticalDamping(loop, K_p);
    const double best = CalcSpectralRadius(loop, {K_p, K_v});
    EXPECT_LT(best, 1.0);
    for (const double change : {0.9, 0.99, 1.01, 1.1}) {
      EXPECT_GT(CalcSpectralRadius(loop, {K_p, change * K_v}), best) << change;
    }
    // Without overshoot from there on, with overshoot before.
    const auto least = [&](double share) {
      const std::vector<double> response = CalcStepResponse(loop, {K_p, share * K_v}, 100 * loop.hold);
      return *std::min_element(response.begin(), response.end());
    };
    EXPECT_GT(least(1.001), 0.0);
    EXPECT_LT(least(0.8), 0.0);
  }
  EXPECT_NEAR(CalcCriticalDamping({1e-9, 1}, 400.0), 40.0, 1e-6) << "the continuous limit";
}

/// The closed loop of `offset` at these gains.
StudyInputs MakeInputs(const std::vector<std::string>& overrides) {
  StudyInputs inputs;
  inputs.study = ParseStudy(
      "name = \"s\"\nscenario = \"offset\"\n[[vary]]\nkey = \"control.K_v\"\nvalues = [1]\n", "study.toml");
  inputs.study.overrides = overrides;
  inputs.scenario_text = ReadTextFile(kFolder + "/offset.toml");
  inputs.scenario_source = "offset";
  inputs.scenario_folder = kFolder;
  inputs.robot = testing::SourcePath("/controller/parameters/assistant_robot.toml");
  inputs.mjcf = testing::SourcePath("/mjcf/scene.xml");
  return inputs;
}

/// Small enough that wheels and motors can follow the strongest gains.
constexpr double kStartError = 1e-7;  // m

std::vector<std::string> MakeOverrides(const SampledLoop& loop, double K_p, double duration,
                                       double start_error) {
  return {"start_error.xyz=[" + FormatNumber(start_error) + ", 0, 0]",
          "plant.time_step=" + FormatNumber(loop.time_step),
          "plant.control_step=" + FormatNumber(loop.period()),
          "duration=" + FormatNumber(duration),
          "settle=0.3",
          "control.K_p=" + FormatNumber(K_p)};
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
  // Other samplings are told apart.
  EXPECT_GT(MeasureDeparture({1e-3, 1}, {1e4, 50}, {1e-3, 2}), 100.0 * kAtEveryStep);
  EXPECT_GT(MeasureDeparture({1e-3, 10}, {400, 40}, {1e-3, 9}), 3.0 * kHeld);
}

// Every kStride-th error follows e'' = trace e' - determinant e. A constant is left where settling leaves the
// object.
constexpr long kStride = 20;

/// trace^2 / 4 - determinant of the recurrence that fits a response best: negative where it swings, zero at
/// critical damping.
double FitDiscriminant(const std::vector<double>& errors) {
  const auto count = static_cast<Eigen::Index>(errors.size()) - 2 * kStride;
  const auto at = [&](Eigen::Index first) {
    return Eigen::Map<const Eigen::VectorXd>(&errors[0] + first, count);
  };
  Eigen::MatrixX3d A(count, 3);
  A << at(kStride), -at(0), Eigen::VectorXd::Ones(count);
  const Eigen::Vector3d fit = A.colPivHouseholderQr().solve(at(2 * kStride));
  return 0.25 * fit[0] * fit[0] - fit[1];
}

// At most ten times what was measured, 1.0e-7 for torques at every step and 1.4e-6 for torques that are held.
constexpr double kDiscriminantAtEveryStep = 1e-6;
constexpr double kDiscriminantHeld = 1e-5;

// The robot's response turns from swinging to creeping within 0.5 % of the predicted K_v.
TEST(SampledStability, TheRobotIsDampedCriticallyWhereItIsPredicted) {
  constexpr double kMargin = 0.005;
  struct Case {
    SampledLoop loop;
    double K_p;
    double tolerance;
  };
  for (const Case& one :
       {Case{{1e-3, 1}, 400.0, kDiscriminantAtEveryStep}, Case{{1e-3, 1}, 2500.0, kDiscriminantAtEveryStep},
        Case{{5e-4, 1}, 400.0, kDiscriminantAtEveryStep}, Case{{1e-3, 4}, 400.0, kDiscriminantHeld}}) {
    const double critical = CalcCriticalDamping(one.loop, one.K_p);
    for (const double share : {1.0 - kMargin, 1.0, 1.0 + kMargin}) {
      const AxisGains gains{one.K_p, share * critical};
      const double measured = FitDiscriminant(MeasureResponse(one.loop, gains, 0.25));
      const double predicted = FitDiscriminant(CalcStepResponse(one.loop, gains, 250));
      EXPECT_NEAR(measured, predicted, one.tolerance) << one.K_p << ", " << share;
      if (share == 1.0) continue;
      EXPECT_EQ(measured > 0.0, share > 1.0) << measured;
      EXPECT_GT(std::abs(predicted), 10.0 * one.tolerance) << "too near to tell";
    }
  }
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

}  // namespace
}  // namespace dexcheck
