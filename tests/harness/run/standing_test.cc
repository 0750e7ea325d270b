// A quadruped on the ground: the shipped scenario with all checks on, each law, and faults that they find.

#include <gtest/gtest.h>

#include <tuple>

#include "harness/checks/step_analysis.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::standing_test {
namespace {

TEST(StandingRun, AllChecksPass) {
  ShippedRun run("stand", {"duration=3"});
  const RunResult& result = run.Run();
  EXPECT_EQ(result.verdict, Verdict::kPass) << result.failure << result.attribution.evidence;
  EXPECT_EQ(run.step().step, 3000);
  for (const char* check : {"law_torque", "inverse_dynamics_robot", "reduced_acceleration", "contact_force",
                            "foot_slip", "foot_slip_rate", "foot_cone_use", "feet_lost", "foot_penetration",
                            "foot_distance", "joint_limit", "solver", "J", "M_bar", "C_bar_xi"}) {
    const auto& checks = run.loop().checks();
    if (checks.Has(check)) EXPECT_EQ(checks.Find(check).count, 3000) << check;
  }
  for (const char* check : {"wheel_slip", "base_tilt", "fingertip_slip", "kappa", "joint_dynamics"})
    EXPECT_FALSE(run.loop().checks().Has(check)) << check;
  EXPECT_GT(run.Worst("foot_cone_use"), 1e-3);
  EXPECT_GT(run.Worst("contact_force"), 1e-12);
  EXPECT_GT(result.tracking.joints_max(), 1e-9);
  // It moves.
  EXPECT_LT(run.step().reading.X_W0.translation().z(), run.setup().start().q[2] - 0.01);
}

class StandingLaws : public ::testing::TestWithParam<const char*> {};

TEST_P(StandingLaws, AreTheirOwnFormulas) {
  ShippedRun run("stand", {"duration=1", "expect={}", std::string("control.law=") + GetParam(),
                           "control.stiffness=300", "control.damping=10"});
  const RunResult& result = run.Run();
  EXPECT_EQ(result.verdict, Verdict::kPass) << result.failure << result.attribution.evidence;
  EXPECT_EQ(run.loop().checks().Find("law_torque").count, 1000);
}
INSTANTIATE_TEST_SUITE_P(All, StandingLaws, ::testing::Values("pd_gravity", "feedforward_pd"));

TEST(StandingRun, ASlipperyFloorIsFound) {
  const std::vector<std::string> swaying = {
      "duration=3", "expect={}", "stance.points=[]",
      "stance.oscillations=[{axis='x',amplitude=0.03,frequency=1.5,ramp_time=1}]"};
  ShippedRun good("stand", swaying);
  EXPECT_EQ(good.Run().verdict, Verdict::kPass);
  std::vector<std::string> slippery = swaying;
  slippery.emplace_back("plant.floor_friction=0.15");
  slippery.emplace_back("duration=0.6");
  ShippedRun run("stand", slippery);
  const RunResult& result = run.Run();
  EXPECT_EQ(result.attribution.cause, Cause::kFootSlip) << result.failure << result.attribution.evidence;
}

// Robot and ground take up what is declared, wherever it acts.
TEST(StandingRun, DeclaredPushesAreNoCause) {
  for (const char* body : {"trunk", "fl_shank"}) {
    ShippedRun run("stand", {"duration=0.2", "expect={}",
                             "disturbance=[{type='pulse',body='" + std::string(body) +
                                 "',force=[1,2,3],torque=[0.1,0,0.2],begin=0.05,duration=0.05}]"});
    const RunResult& result = run.Run();
    EXPECT_EQ(result.verdict, Verdict::kPass)
        << body << ": " << result.failure << result.attribution.evidence;
  }
}

// The equations of motion know the forces of the feet that touch, whichever these are.
TEST(StandingRun, EveryStepIsJudgedAlsoWhileAFootLifts) {
  ShippedRun run("stand", {"duration=0.2", "expect={}",
                           "disturbance=[{type='pulse',body='fl_shank',force=[0,0,26],begin=0.05,"
                           "duration=0.001}]"});
  run.Run();
  EXPECT_GT(run.Worst("feet_lost"), 1e-6);
  for (const char* name : {"equations_of_motion", "inverse_dynamics_robot"}) {
    const CheckRecord& check = run.loop().checks().Find(name);
    EXPECT_EQ(check.count, 200) << name;
    EXPECT_FALSE(check.failed) << name << ' ' << check.worst;
  }
}

TEST(StandingRun, AWrongMassIsFound) {
  ShippedRun run("stand", {"duration=0.2", "model.base.shapes.0.mass=6.06", "expect={}"});
  const RunResult& result = run.Run();
  EXPECT_EQ(result.attribution.cause, Cause::kModel) << result.attribution.evidence;
  EXPECT_TRUE(run.loop().checks().Find("inverse_dynamics_robot").failed);
}

TEST(StandingRun, WhatDoesNotStandIsRefused) {
  EXPECT_THROW(ShippedRun("stand", {"stance.feet.0=fl_hand"}), InputError);
  EXPECT_THROW(ShippedRun("stand", {"plant.type=rigid"}), InputError);
  EXPECT_THROW(ShippedRun("panda-reach", {"stance={feet=['flange','flange','flange'],mu=0.5,f_max=100}"}),
               InputError);
}

}  // namespace
}  // namespace dexcheck::testing::standing_test
