// Made series of one motor or reading with a known fault: its name, its size, when it was there, and what is
// left open where the signal does not tell faults apart.

#include "harness/diagnosis/signal_causes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "harness/diagnosis/sine_fit.h"
#include "tests/harness/diagnosis/made_signals.h"

namespace dexcheck::testing::signal_causes_test {
namespace {

struct Case {
  std::string name;
  std::function<SignalSeries()> make;
  std::vector<Fault> faults;
};

Case MakeCase(const std::string& name, std::vector<Fault> faults,
              const std::function<double(const ArrayXd& u, Index i)>& got) {
  return {name,
          [got] {
            const ArrayXd u = CalcTorque();
            return MakeSeries(MakeEach([&](Index i) { return got(u, i); }));
          },
          std::move(faults)};
}

/// Makes friction of a motion with CalcRate().
Case MakeFriction(const std::string& name, const Fault& fault, const std::function<double(double)>& force) {
  return {name,
          [force] {
            const ArrayXd rate = CalcRate();
            SignalSeries series =
                MakeSeries(CalcTorque() - MakeEach([&](Index i) { return force(rate[i]); }));
            series.rate = rate;
            return series;
          },
          {fault}};
}

/// rad, forth and back.
ArrayXd CalcPosition() { return 0.9 * (2.0 * kPi * 6.0 * CalcTime() + 0.2).sin() + 0.3; }

SignalSeries MakeMoving(const ArrayXd& got) {
  SignalSeries series = MakeSeries(got);
  series.rate = CalcRate();
  series.position = CalcPosition();
  return series;
}

/// A joint's position as an encoder measures it.
SignalSeries MakePosition(const ArrayXd& expected, const ArrayXd& got) {
  SignalSeries series = MakeSeries(expected, got);
  series.name = {"joint elbow", "position", "rad", "joint positions"};
  return series;
}

/// Returns a position that follows at a distance, on both sides.
ArrayXd MakePlay(double half) {
  ArrayXd got = CalcPosition();
  for (Index i = 1; i < kSteps; ++i)
    got[i] = std::clamp(got[i - 1], CalcPosition()[i] - half, CalcPosition()[i] + half);
  return got;
}

class OneMotor : public ::testing::TestWithParam<Case> {};

TEST_P(OneMotor, FaultIsNamedWithItsValue) {
  const SignalSeries series = GetParam().make();
  ASSERT_GT((series.got - series.expected).norm(), 0.0);
  ExpectNamed(Explain(series), GetParam().faults);
}

INSTANTIATE_TEST_SUITE_P(
    Faults, OneMotor,
    ::testing::Values(
        MakeCase("Gain", {OfMotor("gain", 0.97)}, [](const ArrayXd& u, Index i) { return 0.97 * u[i]; }),
        MakeCase("ReversedSign", {OfMotor("gain", -1.0)}, [](const ArrayXd& u, Index i) { return -u[i]; }),
        MakeCase("Offset", {OfMotor("offset", -0.05, "N m")},
                 [](const ArrayXd& u, Index i) { return u[i] - 0.05; }),
        MakeCase("GainAndOffset", {OfMotor("gain", 1.1), OfMotor("offset", 0.2, "N m")},
                 [](const ArrayXd& u, Index i) { return 1.1 * u[i] + 0.2; }),
        MakeCase("DelayOfSixSteps", {OfMotor("delay", 6.0, "steps")},
                 [](const ArrayXd& u, Index i) { return Back(u, i, 6); }),
        MakeCase("DelayBetweenSteps", {OfMotor("delay", 2.4, "steps")},
                 [](const ArrayXd& u, Index i) { return 0.6 * Back(u, i, 2) + 0.4 * Back(u, i, 3); }),
        MakeCase("DelayOfLessThanAStep", {OfMotor("delay", 0.3, "steps")},
                 [](const ArrayXd& u, Index i) { return 0.7 * u[i] + 0.3 * Back(u, i, 1); }),
        MakeCase("GainAndDelay", {OfMotor("delay", 3.0, "steps"), OfMotor("gain", 0.8)},
                 [](const ArrayXd& u, Index i) { return 0.8 * Back(u, i, 3); }),
        MakeCase("OffsetAndDelay", {OfMotor("delay", 3.0, "steps"), OfMotor("offset", 0.1, "N m")},
                 [](const ArrayXd& u, Index i) { return Back(u, i, 3) + 0.1; }),
        MakeCase("DriftOfTheGain", {OfMotor("drift of the gain", -0.3, "1/s")},
                 [](const ArrayXd& u, Index i) { return u[i] * (1.0 - 0.3 * TimeOf(i)); }),
        MakeCase("Ripple", {OfMotor("ripple", 0.06, "N m")},
                 [](const ArrayXd& u, Index i) {
                   return u[i] + 0.06 * std::sin(2.0 * kPi * 41.3 * TimeOf(i) + 0.7);
                 }),
        MakeCase("GainFromStep80", {OfMotor("gain", 0.97)},
                 [](const ArrayXd& u, Index i) { return (i < 80 ? 1.0 : 0.97) * u[i]; }),
        MakeCase("LagFromStep80", {OfMotor("lag", 5e-3, "s")},
                 [](const ArrayXd& u, Index i) {
                   double g = u[79];
                   for (Index k = 80; k <= i; ++k) g += (1.0 - std::exp(-0.2)) * (u[k] - g);
                   return i < 80 ? u[i] : g;
                 }),
        MakeCase("DelayFromStep80", {OfMotor("delay", 4.0, "steps")},
                 [](const ArrayXd& u, Index i) { return i < 80 ? u[i] : Back(u, i, 4); }),
        MakeCase("OffsetForFiveSteps", {OfMotor("offset", 0.05, "N m")},
                 [](const ArrayXd& u, Index i) { return i >= kSteps - 5 ? u[i] + 0.05 : u[i]; }),
        Case{"Lag", [] { return MakeSeries(MakeLag(CalcTorque(), 5e-3)); }, {OfMotor("lag", 5e-3, "s")}},
        Case{"LagOfLessThanAStep",
             [] { return MakeSeries(MakeLag(CalcTorque(), 0.4e-3)); },
             {OfMotor("lag", 0.4e-3, "s")}},
        Case{"GainAndLag",
             [] { return MakeSeries(MakeLag(1.2 * CalcTorque(), 5e-3)); },
             {OfMotor("gain", 1.2), OfMotor("lag", 5e-3, "s")}},
        Case{"OffsetAndLag",
             [] { return MakeSeries(MakeLag(CalcTorque() + 0.3, 5e-3)); },
             {OfMotor("offset", 0.3, "N m"), OfMotor("lag", 5e-3, "s")}},
        MakeCase("DeadZone", {OfMotor("dead zone", 0.15, "N m")},
                 [](const ArrayXd& u, Index i) {
                   return std::abs(u[i]) > 0.15 ? u[i] - std::copysign(0.15, u[i]) : 0.0;
                 }),
        MakeCase("RoundingToSteps", {OfMotor("rounding to steps of", 0.04, "N m")},
                 [](const ArrayXd& u, Index i) { return 0.04 * std::round(u[i] / 0.04); }),
        MakeCase("RoundingToFineSteps", {OfMotor("rounding to steps of", 2.4419e-5, "N m")},
                 [](const ArrayXd& u, Index i) { return 2.4419e-5 * std::round(u[i] / 2.4419e-5); }),
        MakeCase("DriftFromTheFirstStep", {OfMotor("drift", 0.3, "N m/s")},
                 [](const ArrayXd& u, Index i) { return u[i] + 0.3 * TimeOf(i); }),
        MakeCase("DriftThatBeginsBetweenSteps", {OfMotor("drift", -0.3, "N m/s")},
                 [](const ArrayXd& u, Index i) { return u[i] - 0.3 * std::max(0.0, TimeOf(i) - 50.4e-3); }),
        MakeCase("DriftThatBeganBefore", {OfMotor("drift", 0.3, "N m/s")},
                 [](const ArrayXd& u, Index i) { return u[i] + 0.3 * (TimeOf(i) + 0.5); }),
        MakeCase("Limit", {OfMotor("limit", 1.2, "N m")},
                 [](const ArrayXd& u, Index i) { return std::clamp(u[i], -1.2, 1.2); }),
        MakeCase("Stuck", {OfMotor("stuck at", 0.7, "N m")}, [](const ArrayXd&, Index) { return 0.7; }),
        MakeFriction("DryFriction", OfMotor("dry friction", 0.06, "N m"),
                     [](double rate) { return std::copysign(0.06, rate); }),
        MakeFriction("ViscousFriction", OfMotor("viscous friction", 0.08, "N m s/rad"),
                     [](double rate) { return 0.08 * rate; }),
        MakeCase("GainAndOffsetFromStep97", {OfMotor("gain", 0.92), OfMotor("offset", -0.066, "N m")},
                 [](const ArrayXd& u, Index i) { return i < 97 ? u[i] : 0.92 * u[i] - 0.066; }),
        Case{"RippleOverThePosition",
             [] { return MakeMoving(CalcTorque() + 0.05 * (8.0 * CalcPosition() + 0.3).sin()); },
             {OfMotor("ripple over the position", 0.05, "N m")}},
        Case{"Play",
             [] { return MakePosition(CalcPosition(), MakePlay(2e-3)); },
             {{"play", "joint elbow, position", 2e-3, 0.0, "rad", ""}}},
        Case{"Noise",
             [] { return MakeSeries(CalcTorque() + MakeNoise(0.05, 1)); },
             {OfMotor("noise, standard deviation", 0.05, "N m")}},
        Case{"SignalOfAnotherMotor",
             [] { return MakeSeries(CalcOtherTorque()); },
             {OfMotor("signal of motor wrist, gain", 1.0)}}),
    [](const ::testing::TestParamInfo<Case>& info) { return info.param.name; });

struct Unknown {
  std::string name;
  std::function<SignalSeries()> make;
};

/// Makes a motor whose torque contains another signal, or a power of its own.
Unknown MakeUnknown(const std::string& name, const std::function<ArrayXd()>& added) {
  return {name, [added] { return MakeMoving(CalcTorque() + added()); }};
}
/// A reading that every seventh time has not come, and is zero or that of the step before.
Unknown MakeLost(const std::string& name, bool reads_zero) {
  return {name, [reads_zero] {
            ArrayXd got = CalcPosition();
            for (Index i = 20; i < kSteps; i += 7) got[i] = reads_zero ? 0.0 : got[i - 1];
            return MakePosition(CalcPosition(), got);
          }};
}

// An unknown fault does not get the name of a known one.
TEST(SignalCauses, UnknownFaultsAreNotExplained) {
  const Unknown kUnknown[] = {
      MakeUnknown("Crosstalk", [] { return ArrayXd(0.03 * CalcOtherTorque()); }),
      MakeUnknown("GainWherePositive", [] { return ArrayXd(0.05 * CalcTorque().max(0.0)); }),
      MakeUnknown("Square", [] { return ArrayXd(0.02 * CalcTorque().square()); }),
      MakeUnknown("Cube", [] { return ArrayXd(-0.004 * CalcTorque().cube()); }),
      MakeUnknown("SmoothDryFriction", [] { return ArrayXd(-0.06 * (CalcRate() / 0.05).tanh()); }),
      MakeUnknown("FrictionOfTheSquaredRate", [] { return ArrayXd(-0.2 * CalcRate() * CalcRate().abs()); }),
      MakeUnknown("Spring", [] { return ArrayXd(-0.4 * CalcPosition()); }),
      MakeUnknown("Chirp",
                  [] {
                    const ArrayXd t = CalcTime();
                    return ArrayXd(0.1 * (2.0 * kPi * (10.0 * t + 600.0 * t.square())).sin());
                  }),
      MakeLost("LostSamplesAreZero", true),
      MakeLost("LostSamplesAreOld", false)};
  for (const Unknown& one : kUnknown) {
    const Causes causes = Explain(one.make());
    SCOPED_TRACE(one.name + ": " + TextOf(causes));
    ASSERT_EQ(causes.size(), 1u);
    EXPECT_EQ(causes.front().outcome, CauseOutcome::kNotExplained);
  }
}

// Friction brakes.
TEST(SignalCauses, NoFrictionDrives) {
  SignalSeries series = MakeSeries(CalcTorque() + 0.06 * CalcRate().sign());
  series.rate = CalcRate();
  const Causes causes = Explain(series);
  EXPECT_FALSE(Names(causes, "dry friction")) << TextOf(causes);
}

// The last of the seeds have a frequency that explains more than chance would, were it the only one.
TEST(SignalCauses, NoiseIsNamedWithItsDeviation) {
  for (const unsigned seed : {2u, 3u, 4u, 5u, 118u, 128u, 160u, 168u, 250u}) {
    SCOPED_TRACE(seed);
    ExpectNamed(Explain(MakeSeries(CalcTorque() + MakeNoise(0.02, seed))),
                {OfMotor("noise, standard deviation", 0.02, "N m")});
  }
}

// A torque that has one sign has none to tell an offset from a dead zone by.
TEST(SignalCauses, OffsetOrDeadZoneOfOneSignAreAClass) {
  const ArrayXd u = CalcPositiveTorque();
  ASSERT_GT(u.minCoeff(), 0.1);
  const Causes causes = Explain(MakeSeries(u, u - 0.1));
  SCOPED_TRACE(TextOf(causes));
  ASSERT_EQ(causes.size(), 1u);
  EXPECT_EQ(causes.front().outcome, CauseOutcome::kNamedClass);
  EXPECT_THAT(NamesOf(causes.front()), ::testing::UnorderedElementsAre("offset", "dead zone"));
  EXPECT_NEAR(ValueOf(causes.front(), "offset"), -0.1, 1e-3);
  EXPECT_NEAR(ValueOf(causes.front(), "dead zone"), 0.1, 1e-3);
}

// A dead zone is there for good: the torque after step 79 would show it.
TEST(SignalCauses, DeadZoneIsNotOver) {
  const ArrayXd u = CalcPositiveTorque();
  const Causes causes =
      Explain(MakeSeries(u, u - MakeEach([](Index i) { return 40 <= i && i <= 79 ? 0.1 : 0.0; })));
  SCOPED_TRACE(TextOf(causes));
  ASSERT_EQ(causes.size(), 1u);
  EXPECT_TRUE(causes.front().ends);
  EXPECT_EQ(causes.front().outcome, CauseOutcome::kNamed);
  EXPECT_TRUE(causes.front().faults.front().IsLike(OfMotor("offset", -0.1)));
}

// A gain leaves 1e-7 of the offset of a torque that hardly changes, which is far more than rounding.
TEST(SignalCauses, OffsetOfWhatHardlyChangesIsNoGain) {
  const ArrayXd u = 1.0 + 3e-8 * CalcTorque();
  const Causes causes = Explain(MakeSeries(u, u + 0.01));
  SCOPED_TRACE(TextOf(causes));
  ASSERT_EQ(causes.size(), 1u);
  EXPECT_THAT(NamesOf(causes.front()), ::testing::Contains("offset"));
  EXPECT_THAT(NamesOf(causes.front()), ::testing::Not(::testing::Contains("gain")));
}

TEST(SignalCauses, SilenceIsAClass) {
  const ArrayXd u = 0.1 * CalcTorque();
  const Causes causes = Explain(MakeSeries(u, ArrayXd::Zero(kSteps)));
  SCOPED_TRACE(TextOf(causes));
  ASSERT_EQ(causes.size(), 1u);
  EXPECT_EQ(causes.front().outcome, CauseOutcome::kNamedClass);
  EXPECT_THAT(NamesOf(causes.front()),
              ::testing::UnorderedElementsAre("gain", "dead zone", "rounding to steps of"));
  // From step 16 on, before which steps have no history.
  const double largest = u.tail(kSteps - StepStore::kHistory).abs().maxCoeff();
  EXPECT_NEAR(ValueOf(causes.front(), "gain"), 0.0, 1e-9);
  EXPECT_NEAR(ValueOf(causes.front(), "dead zone"), largest, 1e-9);
  EXPECT_NEAR(ValueOf(causes.front(), "rounding to steps of"), 2.0 * largest, 1e-9);
}

TEST(SignalCauses, RoundingIsNeverNamed) {
  const ArrayXd u = CalcTorque();
  const double noise = MakeSeries(u).noise;
  const std::vector<ArrayXd> patterns = {ArrayXd::Ones(kSteps), u / u.abs().maxCoeff(), MakeNoise(0.3, 8),
                                         MakeEach([&](Index i) { return Back(u, i, 1) - u[i]; }),
                                         CalcTime() / TimeOf(kSteps - 1)};
  for (size_t i = 0; i < patterns.size(); ++i) {
    for (const double size : {0.5, 30.0, 300.0}) {
      const ArrayXd change = size * noise / patterns[i].abs().maxCoeff() * patterns[i];
      const Causes causes = Explain(MakeSeries(u, u + change));
      SCOPED_TRACE(std::to_string(i) + ", " + std::to_string(size) + ": " + TextOf(causes));
      // A change below rounding is nothing at all.
      EXPECT_EQ(causes.size(), size < 1.0 ? 0u : 1u);
      for (const Explanation& one : causes) EXPECT_EQ(one.outcome, CauseOutcome::kNotExplained);
    }
    // The pattern is named where it is a fault.
    const Causes causes = Explain(MakeSeries(u, u + 0.1 * patterns[i]));
    ASSERT_EQ(causes.size(), 1u);
    EXPECT_NE(causes.front().outcome, CauseOutcome::kNotExplained) << i << ": " << TextOf(causes);
  }
}

TEST(SignalCauses, OffsetIsToldFromWhenItWasToWhenItWas) {
  struct Span {
    Index first, last;
    bool ends;
  };
  for (const Span& span : {Span{40, 79, true}, Span{0, 79, true}, Span{40, kSteps - 1, false},
                           Span{0, kSteps - 1, false}, Span{40, kSteps - 5, false}}) {
    SCOPED_TRACE(span.first);
    const Causes causes = Explain(MakeSeries(
        CalcTorque() + MakeEach([&](Index i) { return span.first <= i && i <= span.last ? 0.05 : 0.0; })));
    SCOPED_TRACE(TextOf(causes));
    ASSERT_EQ(causes.size(), 1u);
    const Explanation& one = causes.front();
    EXPECT_EQ(one.outcome, CauseOutcome::kNamed);
    EXPECT_TRUE(one.faults.front().IsLike(OfMotor("offset", 0.0)));
    EXPECT_NEAR(one.faults.front().value, 0.05, 1e-6);
    EXPECT_EQ(one.from, CalcTime()[span.first]);
    EXPECT_EQ(one.to, CalcTime()[span.last]);
    EXPECT_EQ(one.ends, span.ends);
  }
}

// Steps are missing before step 60: what came just before it is not known there.
TEST(SignalCauses, StepsWithoutHistoryAreLeftOut) {
  const ArrayXd u = CalcTorque();
  ArrayXd got = MakeEach([&](Index i) { return Back(u, i, 3); });
  got.segment(60, StepStore::kHistory).setConstant(0.5);
  SignalSeries series = MakeSeries(got);
  EXPECT_FALSE(Names(Explain(series), "delay"));
  std::fill_n(series.has_history.begin() + 60, StepStore::kHistory, false);
  ExpectNamed(Explain(series), {OfMotor("delay", 3.0, "steps")});
}

// A limit holds before the torque comes up to it; one that is stuck has to begin there.
TEST(SignalCauses, LimitOfARisingTorqueIsNotStuck) {
  const ArrayXd u = 4.0 + 2.0 * CalcTime() / TimeOf(kSteps - 1);
  const Causes limited = Explain(MakeSeries(u, u.min(5.0)));
  ExpectNamed(limited, {OfMotor("limit", 5.0, "N m")});
  // From the first step on nothing tells them apart.
  const Causes causes = Explain(MakeSeries(u, ArrayXd::Constant(kSteps, 3.9)));
  ASSERT_EQ(causes.size(), 1u);
  EXPECT_THAT(NamesOf(causes.front()), ::testing::IsSupersetOf({"limit", "stuck at"}));
}

// Encoders of robots' joints have no less than 1024 counts a turn.
TEST(SignalCauses, EncoderOfOneValueIsStuckWhereItsStepsWouldBeTooCoarse) {
  for (const bool is_far : {false, true}) {
    SCOPED_TRACE(is_far);
    const ArrayXd u = 1.2 - (is_far ? 0.02 : 0.002) * CalcTime() / TimeOf(kSteps - 1);
    const Causes causes = Explain(MakePosition(u, ArrayXd::Constant(kSteps, 1.2001)));
    SCOPED_TRACE(TextOf(causes));
    ASSERT_EQ(causes.size(), 1u);
    EXPECT_EQ(causes.front().outcome, is_far ? CauseOutcome::kNamed : CauseOutcome::kNamedClass);
    EXPECT_NEAR(ValueOf(causes.front(), "stuck at"), 1.2001, 1e-9);
  }
}

// A reading that rests in one count, and has another value from a step on, may be stuck there or be off by so
// much. That it was right before costs both a beginning, though the past of those steps is not known.
TEST(SignalCauses, RestingReadingIsStuckOrOff) {
  for (const Index first : {Index{8}, Index{40}}) {
    const ArrayXd u = ArrayXd::Constant(kSteps, 0.5);
    const Causes causes =
        Explain(MakePosition(u, u + MakeEach([&](Index i) { return i < first ? 0.0 : 2e-4; })));
    SCOPED_TRACE(TextOf(causes));
    ASSERT_EQ(causes.size(), 1u);
    EXPECT_EQ(causes.front().outcome, CauseOutcome::kNamedClass);
    EXPECT_NEAR(ValueOf(causes.front(), "stuck at"), 0.5002, 1e-9);
    EXPECT_NEAR(ValueOf(causes.front(), "offset"), 2e-4, 1e-9);
    EXPECT_EQ(causes.front().from, CalcTime()[first]);
  }
}

// A limit is a candidate for a torque.
TEST(SignalCauses, PositionHasNoLimit) {
  const ArrayXd got = ArrayXd::Constant(kSteps, 0.9);
  EXPECT_THAT(NamesOf(Explain(MakeSeries(CalcPositiveTorque(), got)).front()), ::testing::Contains("limit"));
  EXPECT_THAT(NamesOf(Explain(MakePosition(CalcPositiveTorque(), got)).front()),
              ::testing::ElementsAre("stuck at"));
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
}  // namespace dexcheck::testing::signal_causes_test
