// An arm without a hand: the shipped scenario, every law, faults that are asked for and faults that are
// hidden.

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "controller/model/parameter_reader.h"
#include "harness/engine/engine.h"
#include "tests/harness/run/changed_parts.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::joint_motion_test {
namespace {

// Rounding of torques against bounds of 1e-13 and more: what each check of a run without contacts leaves.
constexpr double kRounding = 1e-11;

TEST(JointMotionRun, PandaReachesToRounding) {
  ShippedRun run("panda-reach", {"duration=3"});
  const RunResult& result = run.Run();
  EXPECT_TRUE(Passes(result));
  EXPECT_EQ(run.step().step, 3000);
  ASSERT_GE(run.loop().checks().model_checks().size(), 11U);
  for (const CheckRecord& check : run.loop().checks().model_checks()) {
    EXPECT_GE(check.count, 3000) << check.name;
    EXPECT_FALSE(check.failed) << check.name << " " << check.worst;
  }
  for (const char* check :
       {"law_torque", "inverse_dynamics_robot", "equations_of_motion", "joint_dynamics"}) {
    EXPECT_EQ(run.loop().checks().Find(check).count, 3000) << check;
    EXPECT_LE(run.Worst(check), kRounding) << check;
  }
  // Half a step of the way points' jerk, and never nothing: the arm moves.
  EXPECT_LE(result.tracking.joints.max, 1e-4);
  EXPECT_GT(result.tracking.joints.max, 1e-12);
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
  EXPECT_TRUE(Passes(run.Run()));
  EXPECT_EQ(run.loop().checks().Find("law_torque").count, 1000);
  EXPECT_LE(run.Worst("law_torque"), 1e-12);
}

/// The Panda with dry friction in its joints, N m, which model and engine state.
Setup MakeRubbedPanda(double friction, const std::vector<std::string>& overrides) {
  const Scenario scenario = ReadShippedScenario("panda-reach", overrides);
  RobotSpec spec = ReadRobotModel(scenario.model_file).spec();
  for (Joint& joint : spec.joints) joint.dry_friction = friction;
  MjModelPtr engine = LoadMjcf(scenario.mjcf_file);
  std::fill_n(engine->dof_frictionloss, engine->nv, friction);
  return {scenario, RobotModel(spec), scenario.mjcf_file, std::move(engine)};
}

/// Error of the joints, rms, of a run in which all holds.
double FindError(double friction, const std::vector<std::string>& overrides) {
  const Setup setup = MakeRubbedPanda(friction, overrides);
  const std::unique_ptr<Runner> runner = RunParts(setup, MakeLoopParts(setup));
  const RunResult& result = runner->result();
  EXPECT_TRUE(Passes(result));
  EXPECT_LE(runner->loop().checks().Find("law_torque").worst, 1e-12);
  return result.tracking.joints.rms();
}

// Compensation is a summand of the law; on a robot that has the friction it takes most of the error away.
TEST_P(JointLaws, CompensateFriction) {
  std::vector<std::string> keys = {"duration=1", "expect={}", std::string("control.law=") + GetParam()};
  const double without = FindError(0.5, keys);
  keys.insert(keys.end(), {"control.coulomb=0.5", "control.coulomb_velocity=0.02"});
  // pd_gravity does not use the desired motion, which leaves a larger error than friction does.
  EXPECT_LT(FindError(0.5, keys), (GetParam() == std::string("pd_gravity") ? 1.0 : 0.2) * without);
  // On a robot without it, it is an error that the law asks for.
  EXPECT_GT(FindError(0.0, keys), 1e-5);
}

// Torques that a scenario lets be cut off are reported, and no fault; where the arm must follow, they are the
// cause.
TEST(JointMotionRun, LimitedTorquesAreDeclared) {
  const std::vector<std::string> keys = {"duration=1", "actuation.limit={ panda_joint2 = 11 }"};
  const auto with = [&](const char* key) {
    std::vector<std::string> all = keys;
    all.emplace_back(key);
    return all;
  };
  ShippedRun run("panda-reach", with("expect={}"));
  double most = 0.0, cut = 0.0;
  const RunResult& result = run.Run([&] {
    most = std::max(most, std::abs(run.step().drive.tau[1]));
    cut = std::max(cut, std::abs(run.step().command.tau[1]) - 11.0);
  });
  EXPECT_TRUE(Passes(result));
  EXPECT_LE(run.Worst("law_torque"), 1e-12);
  EXPECT_EQ(run.Worst("torque_applied"), 0.0);
  EXPECT_EQ(most, 11.0);
  ASSERT_EQ(result.limited.size(), 7U);
  EXPECT_GT(result.limited[1].time, 0.05);
  EXPECT_NEAR(result.limited[1].most, cut, 1e-12);
  EXPECT_EQ(result.limited[3].time, 0.0);
  ShippedRun asked("panda-reach", with("expect.joints=1e-4"));
  const RunResult& late = asked.Run();
  EXPECT_EQ(late.attribution.cause, Cause::kActuatorLimit) << late.attribution.evidence;
  // Higher than what is sent, it changes nothing.
  ShippedRun high("panda-reach", {"duration=1", "actuation.limit=1000"});
  const RunResult& unlimited = high.Run();
  EXPECT_TRUE(Passes(unlimited));
  EXPECT_TRUE(std::all_of(unlimited.limited.begin(), unlimited.limited.end(),
                          [](const LimitedTorque& one) { return one.time == 0.0; }));
}

INSTANTIATE_TEST_SUITE_P(JointMotionRun, JointLaws,
                         ::testing::Values("computed_torque", "pd_gravity", "feedforward_pd"),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace dexcheck::testing::joint_motion_test
