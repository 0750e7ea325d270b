// The laws that the paper's is compared with, in the loop: their torques are what a second computation from
// the engine's terms says, and another law's are not.

#include <gtest/gtest.h>

#include "harness/checks/check_table.h"
#include "tests/harness/run/changed_parts.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::baseline_reference_test {
namespace {

/// Away from the trajectory, so that every term works.
std::vector<std::string> MakeOverrides(const std::string& law, const std::string& orientation = "angles") {
  return {"control.law=" + law,
          "control.orientation=" + orientation,
          "start_error.xyz=[1e-4, -1e-4, 5e-5]",
          "start_error.zyz=[1e-3, -1e-3, 5e-4]",
          "expect={ from = 0 }",
          "duration=0.4",
          "settle=0.2"};
}

RunResult RunWith(const ShippedRun& spec, const ShippedRun& law, double factor, double* worst) {
  LoopParts parts = MakeLoopParts(spec.setup());
  parts.controller = std::make_unique<ChangedController>(
      MakeLoopParts(law.setup()).controller,
      [=](const GraspModel&, Command* command) { command->tau *= factor; });
  const std::unique_ptr<Runner> runner = RunParts(spec.setup(), std::move(parts));
  *worst = runner->loop().checks().Find("law_torque").worst;
  return runner->result();
}

class BaselineCheck : public ::testing::TestWithParam<std::tuple<const char*, const char*>> {};

TEST_P(BaselineCheck, TheLawPassesToRoundingAndAnotherIsFound) {
  const std::string law = std::get<0>(GetParam());
  const std::string orientation = std::get<1>(GetParam());
  ShippedRun run("curve", MakeOverrides(law, orientation));
  const RunResult& result = run.Run();
  EXPECT_EQ(result.verdict, Verdict::kPass) << result.failure << result.attribution.evidence;
  for (const char* name :
       {"law_torque", "grasp_null_space", "grasp_cone", "grasp_optimality", "torque_applied"}) {
    const CheckRecord& check = run.loop().checks().Find(name);
    EXPECT_LE(check.worst, 0.5 * check.bound) << name;
    EXPECT_GT(check.count, 0) << name;
  }
  EXPECT_FALSE(run.loop().checks().Has("law_demand"));
  EXPECT_EQ(run.loop().checks().Has("closed_loop_spectral_radius"), law == "operational_space");
  EXPECT_EQ(run.loop().checks().Has("error_dynamics"), law == "operational_space");

  double worst = 0.0;
  // A millionth too much, and the law beside it.
  const RunResult scaled = RunWith(run, run, 1.0 + 1e-6, &worst);
  EXPECT_GT(worst, 10.0 * kLawTorqueBound);
  EXPECT_EQ(scaled.attribution.cause, Cause::kControlLaw) << scaled.attribution.evidence;
  const ShippedRun other("curve",
                         MakeOverrides(law == "impedance" ? "feedforward_pd" : "impedance", orientation));
  const RunResult wrong = RunWith(run, other, 1.0, &worst);
  EXPECT_GT(worst, 10.0 * kLawTorqueBound);
  EXPECT_EQ(wrong.attribution.cause, Cause::kControlLaw) << wrong.attribution.evidence;
}

INSTANTIATE_TEST_SUITE_P(
    Laws, BaselineCheck,
    ::testing::Combine(::testing::Values("pd_gravity", "feedforward_pd", "operational_space", "impedance"),
                       ::testing::Values("angles", "rotation")),
    [](const auto& info) { return std::string(std::get<0>(info.param)) + "_" + std::get<1>(info.param); });

// A law that uses the desired motion follows the moving target; one that does not lags behind it.
TEST(BaselineRun, FeedForwardFollowsTheCurveAndPdAloneLags) {
  const auto measure = [](const std::string& law) {
    ShippedRun run("curve", {"control.law=" + law, "expect={ from = 0 }", "duration=2.5", "settle=0.5"});
    const RunResult& result = run.Run();
    EXPECT_TRUE(result.failure.empty()) << law << result.failure;
    return result.tracking.position.max;
  };
  EXPECT_LT(measure("feedforward_pd"), 1e-7);  // measured 3e-9
  EXPECT_LT(measure("impedance"), 1e-7);       // measured 3e-9
  EXPECT_GT(measure("pd_gravity"), 1e-4);      // measured 9e-4
}

// One law by two ways. The inertia as weight moves light fingers rather than the heavy platform.
TEST(BaselineRun, OperationalSpaceDoesWhatTheInertiaAsWeightDoes) {
  const auto run = [](const std::vector<std::string>& overrides) {
    std::vector<std::string> all = {"duration=0.5", "settle=0.5", "expect={ from = 0 }"};
    all.insert(all.end(), overrides.begin(), overrides.end());
    ShippedRun shipped("curve", all);
    const RunResult& result = shipped.Run();
    EXPECT_TRUE(result.failure.empty()) << result.failure;
    return shipped.step().reading.state.q;
  };
  const VectorXd q = run({"control.law=operational_space"});
  EXPECT_LT((q - run({"control.weight=mass"})).norm(), 1e-5);
  EXPECT_GT((q - run({})).norm(), 1e-3);
}

}  // namespace
}  // namespace dexcheck::testing::baseline_reference_test
