// Made series of what a motor or a sensor takes of the state, or of another signal: named with their values,
// also where steps are kept in blocks with gaps between them.

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

struct Case {
  std::string name;
  Fault fault;
  std::function<ArrayXd()> added;  // to the torque
};

class OneCoupling : public ::testing::TestWithParam<Case> {};

TEST_P(OneCoupling, IsNamedWithItsValue) {
  ExpectNamed(Explain(MakeMoving(CalcTorque() + GetParam().added())), {GetParam().fault});
}

INSTANTIATE_TEST_SUITE_P(
    All, OneCoupling,
    ::testing::Values(
        Case{"Crosstalk", OfMotor("crosstalk of motor wrist", 0.03), [] { return 0.03 * CalcOtherTorque(); }},
        Case{"GainWherePositive", OfMotor("gain where positive", 1.05),
             [] { return ArrayXd(0.05 * CalcTorque().max(0.0)); }},
        Case{"Square", OfMotor("square", 0.02, "per N m"),
             [] { return ArrayXd(0.02 * CalcTorque().square()); }},
        Case{"Cube", OfMotor("cube", -0.004, "per N m squared"),
             [] { return ArrayXd(-0.004 * CalcTorque().cube()); }},
        Case{"SmoothDryFriction", OfMotor("dry friction", 0.06, "N m"),
             [] { return ArrayXd(-0.06 * (CalcRate() / 0.05).tanh()); }},
        Case{"FrictionOfTheSquaredRate", OfMotor("friction of the squared rate", 0.2, "N m s^2/rad^2"),
             [] { return ArrayXd(-0.2 * CalcRate() * CalcRate().abs()); }},
        Case{"RippleOverThePosition", OfMotor("ripple over the position", 0.05, "N m"),
             [] { return ArrayXd(0.05 * (8.0 * CalcPosition() + 0.3).sin()); }},
        Case{"Spring", OfMotor("spring", 0.4, "N m/rad"), [] { return ArrayXd(-0.4 * CalcPosition()); }}),
    [](const ::testing::TestParamInfo<Case>& info) { return info.param.name; });

TEST(SignalCouplings, NoSmoothFrictionDrives) {
  const Causes causes = Explain(MakeMoving(CalcTorque() + 0.06 * (CalcRate() / 0.05).tanh()));
  for (const Explanation& one : causes) EXPECT_NE(one.outcome, CauseOutcome::kNamed) << TextOf(causes);
}

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

TEST(SignalCouplings, LostSamplesAreNamedWithTheirFraction) {
  for (const bool reads_zero : {false, true}) {
    SCOPED_TRACE(reads_zero);
    ArrayXd got = CalcPosition();
    int lost = 0;
    for (Index i = 20; i < kSteps; i += 7, ++lost) got[i] = reads_zero ? 0.0 : got[i - 1];
    const Causes causes = Explain(MakePosition(got));
    SCOPED_TRACE(TextOf(causes));
    ASSERT_EQ(causes.size(), 1u);
    EXPECT_EQ(causes.front().outcome, CauseOutcome::kNamed);
    const Fault& fault = causes.front().faults.front();
    EXPECT_EQ(fault.fault, "lost samples, fraction");
    EXPECT_EQ(fault.detail, reads_zero ? "read as 0" : "read as the one before");
    EXPECT_NEAR(fault.value, 1.0 / 7.0, 0.02);
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
