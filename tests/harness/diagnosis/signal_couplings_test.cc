// Made series of what a motor or a sensor takes of the position: named with their values, also where steps
// are kept in blocks with gaps between them. What is no fault that is known gets no other one's name.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "harness/diagnosis/signal_shapes.h"
#include "harness/diagnosis/sine_fit.h"
#include "tests/harness/diagnosis/made_signals.h"

namespace dexcheck::testing::signal_couplings_test {
namespace {

/// rad, forth and back.
ArrayXd CalcPosition() { return 0.9 * (2.0 * kPi * 6.0 * CalcTime() + 0.2).sin() + 0.3; }

SignalSeries MakeMoving(const ArrayXd& got) {
  SignalSeries series = MakeSeries(got);
  series.rate = CalcRate();
  series.position = CalcPosition();
  return series;
}

TEST(SignalCouplings, RippleOverThePositionIsNamed) {
  ExpectNamed(Explain(MakeMoving(CalcTorque() + 0.05 * (8.0 * CalcPosition() + 0.3).sin())),
              {OfMotor("ripple over the position", 0.05, "N m")});
}

struct Unknown {
  std::string name;
  std::function<ArrayXd()> added;  // to the torque
};

class UnknownCoupling : public ::testing::TestWithParam<Unknown> {};

TEST_P(UnknownCoupling, IsNotExplained) {
  const Causes causes = Explain(MakeMoving(CalcTorque() + GetParam().added()));
  SCOPED_TRACE(TextOf(causes));
  ASSERT_EQ(causes.size(), 1u);
  EXPECT_EQ(causes.front().outcome, CauseOutcome::kNotExplained);
}

INSTANTIATE_TEST_SUITE_P(
    All, UnknownCoupling,
    ::testing::Values(
        Unknown{"Crosstalk", [] { return ArrayXd(0.03 * CalcOtherTorque()); }},
        Unknown{"GainWherePositive", [] { return ArrayXd(0.05 * CalcTorque().max(0.0)); }},
        Unknown{"Square", [] { return ArrayXd(0.02 * CalcTorque().square()); }},
        Unknown{"Cube", [] { return ArrayXd(-0.004 * CalcTorque().cube()); }},
        Unknown{"SmoothDryFriction", [] { return ArrayXd(-0.06 * (CalcRate() / 0.05).tanh()); }},
        Unknown{"FrictionOfTheSquaredRate", [] { return ArrayXd(-0.2 * CalcRate() * CalcRate().abs()); }},
        Unknown{"Spring", [] { return ArrayXd(-0.4 * CalcPosition()); }}),
    [](const ::testing::TestParamInfo<Unknown>& info) { return info.param.name; });

SignalSeries MakePosition(const ArrayXd& got) {
  SignalSeries series = MakeSeries(CalcPosition(), got);
  series.name = {"joint elbow", "position", "rad", "joint positions"};
  return series;
}

TEST(SignalCouplings, PlayIsNamedWithHalfItsWidth) {
  constexpr double kHalf = 2e-3;
  const ArrayXd position = CalcPosition();
  ArrayXd got = position;
  for (Index i = 1; i < kSteps; ++i)
    got[i] = std::clamp(got[i - 1], position[i] - kHalf, position[i] + kHalf);
  ExpectNamed(Explain(MakePosition(got)), {{"play", "joint elbow, position", kHalf, 0.0, "rad", ""}});
}

TEST(SignalCouplings, LostSamplesAreNotExplained) {
  for (const bool reads_zero : {false, true}) {
    SCOPED_TRACE(reads_zero);
    ArrayXd got = CalcPosition();
    for (Index i = 20; i < kSteps; i += 7) got[i] = reads_zero ? 0.0 : got[i - 1];
    const Causes causes = Explain(MakePosition(got));
    SCOPED_TRACE(TextOf(causes));
    ASSERT_EQ(causes.size(), 1u);
    EXPECT_EQ(causes.front().outcome, CauseOutcome::kNotExplained);
  }
}

/// Blocks of 48 steps, 512 apart, show frequencies that are 1.95 Hz apart nearly alike.
TEST(SineFit, FindsTheFrequencyInSpiteOfGaps) {
  std::vector<double> times;
  for (int block = 0; block < 12; ++block)
    for (int i = 0; i < 48; ++i) times.push_back(1e-3 * (512 * block + i));
  const ArrayXd t = Eigen::Map<const ArrayXd>(times.data(), static_cast<Index>(times.size()));
  for (const double frequency : {0.7, 4.7746, 11.3, 60.0}) {
    const Sine sine = FindSine(1e-4 * (2.0 * kPi * frequency * t + 0.4).sin(), t);
    EXPECT_NEAR(sine.frequency, frequency, 1e-8 * TolScale());
  }
}

}  // namespace
}  // namespace dexcheck::testing::signal_couplings_test
