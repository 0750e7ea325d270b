// An arm without a hand: the shipped scenario, every law, faults that are asked for and faults that are
// hidden.

#include <gtest/gtest.h>

#include "controller/control/joint_controller.h"
#include "tests/harness/run/changed_parts.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::joint_motion_test {
namespace {

// Rounding of torques against bounds of 1e-13 and more: what each check of a run without contacts leaves.
constexpr double kRounding = 1e-11;

TEST(JointMotionRun, PandaReachesToRounding) {
  ShippedRun run("panda-reach", {"duration=3"});
  const RunResult& result = run.Run();
  EXPECT_EQ(result.verdict, Verdict::kPass) << result.failure << result.attribution.evidence;
  EXPECT_EQ(run.step().step, 3000);
  ASSERT_GE(run.loop().checks().model_checks().size(), 11U);
  for (const CheckRecord& check : run.loop().checks().model_checks()) {
    EXPECT_GE(check.count, 3000) << check.name;
    EXPECT_FALSE(check.failed) << check.name << " " << check.worst;
  }
  for (const char* check :
       {"law_torque", "inverse_dynamics_robot", "reduced_acceleration", "joint_dynamics"}) {
    EXPECT_EQ(run.loop().checks().Find(check).count, 3000) << check;
    EXPECT_LE(run.Worst(check), kRounding) << check;
  }
  // Half a step of the way points' jerk, and never nothing: the arm moves.
  EXPECT_LE(result.tracking.joints_max(), 1e-4);
  EXPECT_GT(result.tracking.joints_max(), 1e-12);
  EXPECT_GT(run.step().reading.state.xi.cwiseAbs().maxCoeff(), 0.1);
  // Nothing is held, and nothing is said of it.
  for (const char* check :
       {"contact_force", "fingertip_slip", "kappa", "inverse_dynamics_object", "grasp_optimality"}) {
    EXPECT_FALSE(run.loop().checks().Has(check)) << check;
  }
}

class JointLaws : public ::testing::TestWithParam<const char*> {};

TEST_P(JointLaws, AreTheirOwnFormulas) {
  ShippedRun run("panda-reach",
                 {"duration=1", "expect.joints=0.1", std::string("control.law=") + GetParam()});
  const RunResult& result = run.Run();
  EXPECT_EQ(result.verdict, Verdict::kPass) << result.failure << result.attribution.evidence;
  EXPECT_EQ(run.loop().checks().Find("law_torque").count, 1000);
  EXPECT_LE(run.Worst("law_torque"), 1e-12);
}

INSTANTIATE_TEST_SUITE_P(JointMotionRun, JointLaws,
                         ::testing::Values("computed_torque", "pd_gravity", "feedforward_pd"),
                         [](const auto& info) { return std::string(info.param); });

TEST(JointMotionRun, WrongNumbersOfTheModelAreFound) {
  ShippedRun run("panda-reach", {"duration=0.5", "model.chain.0.links.link3.mass=3.3"});
  const RunResult& result = run.Run();
  EXPECT_EQ(result.verdict, Verdict::kDisagreement);
  EXPECT_EQ(result.attribution.cause, Cause::kModel) << result.attribution.evidence;
}

TEST(JointMotionRun, AForceThatNobodyKnowsIsNamed) {
  ShippedRun run("panda-reach", {"duration=0.2"});
  const auto& setup = run.setup();
  LoopParts parts = MakeLoopParts(setup);
  // A push that the scenario does not ask for.
  DisturbanceOptions push;
  push.kind = DisturbanceOptions::Kind::kStep;
  push.body = "panda_link5";
  push.force = {0.0, 2.0, 0.0};
  push.at = {-0.011953, 0.041065, -0.038437};  // the centre of mass, where such forces are looked for
  push.key = "hidden";
  parts.disturbances.push_back(push);
  Runner runner(setup, /*check=*/true, std::move(parts));
  const RunResult& result = runner.Run([](const StepRecord&) {}, [] { return false; });
  EXPECT_EQ(result.attribution.cause, Cause::kUnmodelledForce) << result.attribution.evidence;
  EXPECT_NE(result.attribution.evidence.find("panda_link5"), std::string::npos)
      << result.attribution.evidence;
}

TEST(JointMotionRun, WhatTheScenarioAsksForCriesNoWolf) {
  ShippedRun run("panda-reach",
                 {"duration=1", "expect.joints=0.1",
                  "sensing={ joint_counts = 4096, velocity = 'differenced', "
                  "velocity_cutoff = 60 }",
                  "actuation={ delay = 0.002, torque_step = 0.01 }", "mismatch={ mass = 1.05 }",
                  "disturbance=[{ type = 'step', body = 'panda_link5', force = [0, 2, 0] }]"});
  const RunResult& result = run.Run();
  EXPECT_EQ(result.verdict, Verdict::kPass) << result.failure << result.attribution.evidence;
  EXPECT_GT(result.tracking.joints_max(), 1e-5);
  EXPECT_EQ(run.loop().checks().Find("joint_dynamics").count, 1000);
}

TEST(JointMotionRun, AWrongTorqueIsTheLawsFault) {
  ShippedRun run("panda-reach", {"duration=0.2"});
  LoopParts parts = MakeLoopParts(run.setup());
  parts.controller = std::make_unique<ChangedController>(
      std::move(parts.controller), [](const GraspModel&, Command* command) { command->tau[4] += 1e-3; });
  const std::unique_ptr<Runner> runner = RunParts(run.setup(), std::move(parts));
  const RunResult& result = runner->result();
  EXPECT_EQ(result.attribution.cause, Cause::kControlLaw) << result.attribution.evidence;
  EXPECT_NE(result.attribution.evidence.find("law of panda_joint5: torque 0.001"), std::string::npos)
      << result.attribution.evidence;
}

TEST(JointMotionRun, TorquesMayBeHeld) {
  ShippedRun run("panda-reach", {"duration=0.5", "expect.joints=0.01", "plant.control_step=0.004"});
  const RunResult& result = run.Run();
  EXPECT_EQ(result.verdict, Verdict::kPass) << result.failure << result.attribution.evidence;
  EXPECT_EQ(run.loop().checks().Find("law_torque").count, 125);
}

}  // namespace
}  // namespace dexcheck::testing::joint_motion_test
