// Declared imperfections are considered only where nothing else explains the failure.

#include "harness/run/declared_share.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/common/matchers.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::declared_share_test {
namespace {

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
}  // namespace dexcheck::testing::declared_share_test
