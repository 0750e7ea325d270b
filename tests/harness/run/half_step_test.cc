// Time stepping is the cause only where half the step shows it.

#include "harness/run/half_step.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/common/matchers.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::half_step_test {
namespace {

RunResult Look(
    ShippedRun* run, const std::function<bool()>& should_stop = [] { return false; }) {
  RunResult result = run->Run();
  LookForIntegrator(run->setup(), run->loop(), SourcePath("/controller/parameters/assistant_robot.toml"),
                    SourcePath("/mjcf/scene.xml"), should_stop, &result);
  return result;
}

// The rigid plant integrates to the fourth order, but torques that are held during a step are of the first.
// Those of a law whose closed loop is not (57) are not known beforehand.
TEST(HalfStep, NamesAnErrorOfTheFirstOrder) {
  ShippedRun run("curve", {"duration=0.3", "settle=0.2", "plant.type=rigid", "control.law=feedforward_pd",
                           "expect.position=1e-13"});
  const RunResult result = Look(&run);
  EXPECT_EQ(result.attribution.cause, Cause::kIntegrator) << result.attribution.evidence;
  EXPECT_THAT(result.attribution.evidence, HasSubstr("at half the step"));
  ASSERT_FALSE(result.attribution.attributions.empty());
  EXPECT_EQ(result.attribution.attributions[0].cause, Cause::kIntegrator);
}

// The gains leave as much at any step.
TEST(HalfStep, LeavesTheLawItsErrors) {
  ShippedRun run("offset", {"duration=0.1", "settle=0.3", "expect.from=0", "expect.position=1e-9"});
  const RunResult result = Look(&run);
  EXPECT_EQ(result.attribution.cause, Cause::kControlLaw) << result.attribution.evidence;
  EXPECT_THAT(result.attribution.evidence, HasSubstr("at half the step"));
  EXPECT_THAT(result.attribution.evidence, HasSubstr("(57) by itself leaves 0.0001 m"));
}

TEST(HalfStep, RepeatsNothingWhereAnotherCauseWasFound) {
  ShippedRun run("curve", {"duration=0.05", "settle=0.2", "model.object.mass=0.21"});
  const RunResult result = Look(&run, []() -> bool { throw std::logic_error("was repeated"); });
  EXPECT_EQ(result.attribution.cause, Cause::kModel);
  EXPECT_THAT(result.attribution.evidence, Not(HasSubstr("half the step")));
}

}  // namespace
}  // namespace dexcheck::testing::half_step_test
