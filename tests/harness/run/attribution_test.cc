// Compared quantities, how runs fail, faults of sensors that nobody declares, and the share of what is
// declared.

#include <gmock/gmock.h>

#include <algorithm>
#include <functional>
#include <utility>

#include "harness/diagnosis/signal_causes.h"
#include "harness/run/runner.h"
#include "tests/common/matchers.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::attribution_test {
namespace {

// The comparison uses the plant as the scenario changes it, not the MJCF's.
TEST(ConstantsAsSimulated, HaveTheFrictionOfTheScenario) {
  const auto differs = [](const std::vector<std::string>& overrides) {
    const ShippedRun run("hold", overrides);
    const std::vector<ConstantFinding>& findings = run.setup().constants().findings;
    return std::ranges::any_of(
        findings, [](const ConstantFinding& finding) { return finding.check == "contact_friction"; });
  };
  EXPECT_FALSE(differs({}));
  EXPECT_TRUE(differs({"plant.finger_friction=0.3"}));
  EXPECT_TRUE(differs({"model.object.friction=0.3"}));
  EXPECT_FALSE(differs({"plant.finger_friction=0.3", "model.object.friction=0.3"}));
  EXPECT_FALSE(differs({"mismatch.friction=0.3"}));
}

struct Failure {
  const char* name;
  std::vector<std::string> overrides;
  const char* message;
};

const Failure kFailures[] = {
    {"motor_limit",
     {"duration=1", "control.natural_frequency=100", "start_error.xyz=[0, 0, 0.05]"},
     "is at its limit"},
    {"not_finite", {"duration=1", "start_error.xyz=[1e308, 0, 0]"}, "not finite"},
    {"fall",
     {"duration=5", "plant.floor_friction=3",
      "trajectory={ type = 'circle', speed = 3, radius = 1.5, ramp_time = 5 }"},
     "the robot fell"},
    {"lost_grasp",
     {"plant.finger_friction=0.15", "control.weight={ platform = 1e8, arm = 1e8 }"},
     "the grasp is lost"},
    {"no_forces", {"duration=1", "control.f_max=0.3", "control.f_min=0"}, "contact forces"}};

TEST(Failures, EndTheRunWithTheirReason) {
  for (const Failure& failure : kFailures) {
    SCOPED_TRACE(failure.name);
    ShippedRun run("paper-ramp", failure.overrides);
    const RunResult& result = run.Run();
    EXPECT_EQ(result.verdict, Verdict::kFailed);
    EXPECT_THAT(result.failure, HasSubstr(failure.message));
  }
}

/// A Panda with a hidden fault of its sensors.
ClosedLoop MakeSensorFault(const Setup& setup, std::function<void(double t, MeasuredState*)> fault) {
  LoopParts parts = MakeLoopParts(setup);
  parts.hidden_sensor_fault = std::move(fault);
  return {setup, /*check=*/true, std::move(parts)};
}

// The first torque is above its limit, so that no step is ever judged.
TEST(HiddenSensorFault, ThatEndsTheRunAtOnceIsToldWhereItIs) {
  const ShippedRun run("panda-reach");
  ClosedLoop loop =
      MakeSensorFault(run.setup(), [](double, MeasuredState* state) { std::swap(state->q[4], state->q[5]); });
  EXPECT_THROW(loop.Settle(), RunFailure);
  const Causes causes = ExplainSignals(loop.store());
  ASSERT_EQ(causes.size(), 2u);
  EXPECT_EQ(causes[0].faults.front().place, "joint panda_joint5, position");
  EXPECT_EQ(causes[1].faults.front().place, "joint panda_joint6, position");
}

// Not all steps of a long run are kept, and still the times are known.
TEST(HiddenSensorFault, IsToldFromItsFirstStepToItsLast) {
  const ShippedRun run("panda-reach", {"duration=2.5"});
  ClosedLoop loop = MakeSensorFault(run.setup(), [](double t, MeasuredState* state) {
    if (t > 0.1) state->q[1] += 1e-9;
    if (t > 1.3205 && t < 1.9005) state->q[3] += 1e-4;
  });
  loop.Settle();
  while (!loop.is_finished()) loop.Step();
  const Causes causes = ExplainSignals(loop.store());
  ASSERT_EQ(causes.size(), 2u);
  const Explanation& late = causes[1];
  EXPECT_EQ(late.faults.front().place, "joint panda_joint4, position");
  EXPECT_NEAR(late.from, 1.321, 1e-9);
  EXPECT_NEAR(late.to, 1.9, 1e-9);
  EXPECT_TRUE(late.ends);
}

// It is over when the run begins, and what it did to the robot is not the law's fault.
TEST(HiddenSensorFault, WhileEverythingSettlesIsToldWithItsTimes) {
  const ShippedRun run("panda-reach", {"duration=0.1", "settle=0.5", "expect.from=0", "expect.joints=1e-9"});
  LoopParts parts = MakeLoopParts(run.setup());
  parts.hidden_sensor_fault = [](double t, MeasuredState* state) {
    if (t > 0.2005 && t < 0.3005) state->q[3] += 1e-4;
  };
  Runner runner(run.setup(), /*check=*/true, std::move(parts));
  const RunResult& result = runner.Run([](const StepRecord&) {}, [] { return false; });
  EXPECT_TRUE(runner.loop().checks().Find("expect_joints").failed);
  EXPECT_EQ(result.verdict, Verdict::kDisagreement);
  EXPECT_EQ(result.attribution.cause, Cause::kSensing);
  ASSERT_FALSE(result.causes.empty());
  const Explanation& first = result.causes.front();
  EXPECT_EQ(first.faults.front().place, "joint panda_joint4, position");
  EXPECT_NEAR(first.from, -0.299, 1e-9);
  EXPECT_NEAR(first.to, -0.2, 1e-9);
  EXPECT_TRUE(first.ends);
}

// Declared imperfections are considered only where nothing else explains the failure.
const std::vector<std::string> kExpectsMuch = {"duration=0.1", "settle=0.3", "expect.from=0",
                                               "expect.position=1e-9", "actuation.delay=0.001"};

RunResult Look(
    ShippedRun* run, const std::function<bool()>& should_stop = [] { return false; }) {
  RunResult result = run->Run();
  WeighDeclared(run->setup(), run->loop(), SourcePath("/controller/parameters/assistant_robot.toml"),
                SourcePath("/mjcf/scene.xml"), should_stop, &result);
  return result;
}

TEST(WeighDeclared, SaysHowMuchOfAnErrorItExplains) {
  ShippedRun run("offset", kExpectsMuch);
  const RunResult result = Look(&run);
  EXPECT_THAT(result.attribution.evidence,
              HasSubstr("without what the scenario declares (actuation.delay = 0.001)"));
  EXPECT_THAT(result.attribution.evidence, HasSubstr("% of the error"));
}

TEST(WeighDeclared, SaysNothingWhenItIsStopped) {
  ShippedRun run("offset", kExpectsMuch);
  EXPECT_THAT(Look(&run, [] { return true; }).attribution.evidence, Not(HasSubstr("without what")));
}

TEST(WeighDeclared, RepeatsNothingWhereAnotherCauseWasFound) {
  ShippedRun run("curve", {"duration=0.05", "settle=0.2", "actuation.delay=0.001", "model.object.mass=0.21"});
  const RunResult result = Look(&run, []() -> bool { throw std::logic_error("was repeated"); });
  EXPECT_EQ(result.attribution.cause, Cause::kModel);
}

}  // namespace
}  // namespace dexcheck::testing::attribution_test
