// A fault that all motors share is reported once, and a further fault of one motor is judged beside it.

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

struct Beside {
  std::string name;
  Fault common, own;
  std::function<ArrayXd(const ArrayXd&)> make_common, make_own;
};

ArrayXd Delay(const ArrayXd& u, Index steps) {
  return MakeEach([&](Index i) { return Back(u, i, steps); });
}
/// The commands before the first step are unknown.
ArrayXd DelayUnknown(const ArrayXd& u, Index steps) {
  ArrayXd late = Delay(u, steps);
  late.head(steps) += 0.1;
  return late;
}
ArrayXd Round(const ArrayXd& u, double step) { return step * (u / step).round(); }

const Beside kBeside[] = {
    {"Gains", OfMotor("gain", 1.003), OfMotor("gain", 0.95),
     [](const ArrayXd& u) { return ArrayXd(1.003 * u); }, [](const ArrayXd& u) { return ArrayXd(0.95 * u); }},
    {"RoundingAndGain", OfMotor("gain", 1.003), OfMotor("rounding to steps of", 0.04, "N m"),
     [](const ArrayXd& u) { return ArrayXd(1.003 * u); }, [](const ArrayXd& u) { return Round(u, 0.04); }},
    {"DelayAndGain", OfMotor("delay", 3.0, "steps"), OfMotor("gain", 0.95),
     [](const ArrayXd& u) { return Delay(u, 3); }, [](const ArrayXd& u) { return ArrayXd(0.95 * u); }},
    {"DelayAndLateOffset", OfMotor("delay", 3.0, "steps"), OfMotor("offset", 0.2, "N m"),
     [](const ArrayXd& u) { return DelayUnknown(u, 3); },
     [](const ArrayXd& u) {
       ArrayXd late = u;
       late.tail(kSteps / 2) += 0.2;
       return late;
     }},
    {"DelayAndLimit", OfMotor("delay", 3.0, "steps"), OfMotor("limit", 1.2, "N m"),
     [](const ArrayXd& u) { return Delay(u, 3); },
     [](const ArrayXd& u) { return ArrayXd(u.min(1.2).max(-1.2)); }},
    {"Delays", OfMotor("delay", 1.0, "steps"), OfMotor("delay", 8.0, "steps"),
     [](const ArrayXd& u) { return Delay(u, 1); }, [](const ArrayXd& u) { return Delay(u, 8); }},
    {"LagAndGain", OfMotor("lag", 5e-3, "s"), OfMotor("gain", 0.95),
     [](const ArrayXd& u) { return MakeLag(u, 5e-3); }, [](const ArrayXd& u) { return ArrayXd(0.95 * u); }},
    {"LagAndOffset", OfMotor("lag", 5e-3, "s"), OfMotor("offset", 0.2, "N m"),
     [](const ArrayXd& u) { return MakeLag(u, 5e-3); }, [](const ArrayXd& u) { return ArrayXd(u + 0.2); }},
    {"RoundingAndOffset", OfMotor("rounding to steps of", 0.01, "N m"), OfMotor("offset", 0.3, "N m"),
     [](const ArrayXd& u) { return Round(u, 0.01); }, [](const ArrayXd& u) { return ArrayXd(u + 0.3); }}};

TEST(SignalCauses, MotorBesideAllIsNamedWithThem) {
  for (const Beside& made : kBeside) {
    SCOPED_TRACE(made.name);
    Fault common = made.common;
    common.place = "all motors";
    ExpectNamed(ExplainSignals(MakeMotors(made.make_common, made.make_own), CauseChannel::kActuation),
                {common, made.own});
  }
}

// Rounding by all changes the size of a motor's own steps or noise.
TEST(SignalCauses, StepsAndNoiseBeforeTheStepsOfAllAreNotExplained) {
  const std::vector<std::pair<double, std::function<ArrayXd(const ArrayXd&)>>> made = {
      {0.01, [](const ArrayXd& u) { return Round(u, 0.217); }},
      {0.05, [](const ArrayXd& u) { return ArrayXd(u + MakeNoise(0.01, 5)); }}};
  for (const auto& [step, make_own] : made) {
    const Causes causes =
        ExplainSignals(MakeMotors([step = step](const ArrayXd& u) { return Round(u, step); }, make_own),
                       CauseChannel::kActuation);
    SCOPED_TRACE(TextOf(causes));
    ASSERT_EQ(causes.size(), 2u);
    EXPECT_TRUE(
        causes.front().faults.front().IsLike({"rounding to steps of", "all motors", step, 0.0, "N m", ""}));
    EXPECT_EQ(causes.back().outcome, CauseOutcome::kNotExplained);
  }
}

// A motor that gives nothing has the steps of all, if they are wide enough.
TEST(SignalCauses, SilentMotorIsOneOfAllThatRound) {
  const auto round = [](const ArrayXd& u) { return Round(u, 0.01); };
  const Causes causes = ExplainSignals(MakeMotors(round, [](const ArrayXd& u) { return ArrayXd(1e-3 * u); }),
                                       CauseChannel::kActuation);
  SCOPED_TRACE(TextOf(causes));
  ASSERT_GE(causes.size(), 1u);
  EXPECT_EQ(causes.front().faults.front().place, "all motors");
  Motors motors = MakeMotors(round, [](const ArrayXd& u) { return u; });
  motors.front().expected *= 1e-3;
  motors.front().got.setZero();
  const Causes all = ExplainSignals(motors, CauseChannel::kActuation);
  SCOPED_TRACE(TextOf(all));
  ExpectNamed(all, {{"rounding to steps of", "all motors", 0.01, 0.0, "N m", ""}});
}

// Joints are all that moves in a robot without an object.
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
