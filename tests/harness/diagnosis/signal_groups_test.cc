// What all motors have alike is told once, and what one of them has besides is judged beside that.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "tests/harness/diagnosis/made_signals.h"

namespace dexcheck::testing::signal_groups_test {
namespace {

using Motors = std::vector<SignalSeries>;

/// Eight motors of unlike torques that are transmitted in this way. @param own of the first one.
Motors MakeMotors(const std::function<ArrayXd(const ArrayXd&)>& common,
                  const std::function<ArrayXd(const ArrayXd&)>& own) {
  Motors motors;
  for (int i = 0; i < 8; ++i) {
    const double phase = 0.7 * i;
    const ArrayXd u = 2.0 * ((55.0 + 9.0 * i) * CalcTime() + phase).sin() + 0.3 * i;
    SignalSeries one = MakeSeries(u, common(i == 0 ? own(u) : u));
    one.name.place = i == 0 ? "motor elbow" : "motor " + std::to_string(i);
    motors.push_back(one);
  }
  return motors;
}

ArrayXd Delay(const ArrayXd& u, Index steps) {
  return MakeEach([&](Index i) { return Back(u, i, steps); });
}
ArrayXd Round(const ArrayXd& u, double step) { return step * (u / step).round(); }

Fault OfAll(Fault fault) {
  fault.place = "all motors";
  return fault;
}

// A second gain and a second delay are those of one motor beside all.
TEST(SignalCauses, OwnFaultOfTheSameKindIsNamedBesideThatOfAll) {
  const auto scale = [](double by) { return [by](const ArrayXd& u) { return ArrayXd(by * u); }; };
  ExpectNamed(ExplainSignals(MakeMotors(scale(1.003), scale(0.95)), CauseChannel::kActuation),
              {OfAll(OfMotor("gain", 1.003)), OfMotor("gain", 0.95)});
  const auto delay = [](Index by) { return [by](const ArrayXd& u) { return Delay(u, by); }; };
  ExpectNamed(ExplainSignals(MakeMotors(delay(1), delay(8)), CauseChannel::kActuation),
              {OfAll(OfMotor("delay", 1.0, "steps")), OfMotor("delay", 8.0, "steps")});
}

// What the steps or the gain of all make of a motor's own steps or noise has another size, and another name.
TEST(SignalCauses, WhatDoesNotShowTheFaultOfAllIsNotExplained) {
  using Make = std::function<ArrayXd(const ArrayXd&)>;
  const std::vector<std::pair<Make, Make>> made = {
      {[](const ArrayXd& u) { return Round(u, 0.01); }, [](const ArrayXd& u) { return Round(u, 0.217); }},
      {[](const ArrayXd& u) { return Round(u, 0.05); },
       [](const ArrayXd& u) { return ArrayXd(u + MakeNoise(0.01, 5)); }},
      {[](const ArrayXd& u) { return ArrayXd(1.003 * u); }, [](const ArrayXd& u) { return Round(u, 0.04); }},
      {[](const ArrayXd& u) { return Delay(u, 3); },
       [](const ArrayXd& u) { return ArrayXd(u.min(1.2).max(-1.2)); }}};
  for (const auto& [make_common, make_own] : made) {
    const Causes causes = ExplainSignals(MakeMotors(make_common, make_own), CauseChannel::kActuation);
    SCOPED_TRACE(TextOf(causes));
    ASSERT_EQ(causes.size(), 2u);
    EXPECT_EQ(causes.front().faults.front().place, "all motors");
    EXPECT_EQ(causes.front().outcome, CauseOutcome::kNamed);
    EXPECT_EQ(causes.back().outcome, CauseOutcome::kNotExplained);
  }
}

// A motor that gives nothing has the steps of all, if they are wide enough.
TEST(SignalCauses, SilentMotorIsOneOfAllThatRound) {
  for (const bool is_small : {true, false}) {
    Motors motors =
        MakeMotors([](const ArrayXd& u) { return Round(u, 0.01); }, [](const ArrayXd& u) { return u; });
    // Five of the eight are silent where the steps are wide: more than those that show them.
    for (size_t i = 0; i < (is_small ? 5 : 1); ++i) {
      if (is_small) motors[i].expected *= 1e-3;
      motors[i].got.setZero();
    }
    const Causes causes = ExplainSignals(motors, CauseChannel::kActuation);
    SCOPED_TRACE(TextOf(causes));
    ASSERT_EQ(causes.size(), is_small ? 1u : 2u);
    EXPECT_TRUE(causes.front().faults.front().IsLike(OfAll(OfMotor("rounding to steps of", 0.01))));
    if (!is_small) EXPECT_EQ(causes.back().faults.front().place, "motor elbow");
  }
}

// Of a robot without an object joints are all that moves.
TEST(SignalCauses, DelayOfAllThatMovesIsOfEverything) {
  for (const bool has_object : {false, true}) {
    Motors readings =
        MakeMotors([](const ArrayXd& u) { return Delay(u, 2); }, [](const ArrayXd& u) { return u; });
    for (size_t i = 0; i < readings.size(); ++i)
      readings[i].name = {"joint " + std::to_string(i), i < 4 ? "position" : "rate", "rad",
                          i < 4 ? "joint positions" : "joint rates"};
    SignalSeries object = readings.front();
    object.name = {"object", "position x", "m", "object position"};
    object.got = object.expected;
    if (!has_object) object.got = object.expected = VectorXd::Constant(kSteps, 0.3);
    readings.push_back(object);
    const Causes causes = ExplainSignals(readings, CauseChannel::kMeasurement);
    ExpectNamed(causes,
                {{"delay", has_object ? "all joint positions, joint rates" : "everything that is measured",
                  2.0, 0.0, "steps", ""}});
  }
}

}  // namespace
}  // namespace dexcheck::testing::signal_groups_test
