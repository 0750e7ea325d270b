// A quadruped on the ground: the shipped scenario with all checks on, each law, and faults that they find.

#include <gtest/gtest.h>

#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::standing_test {
namespace {

TEST(StandingRun, AllChecksPass) {
  ShippedRun run("stand", {"duration=3"});
  const RunResult& result = run.Run();
  EXPECT_TRUE(Passes(result));
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
  EXPECT_GT(result.tracking.joints.max, 1e-9);
  // It moves.
  EXPECT_LT(run.step().reading.X_W0.translation().z(), run.setup().start().q[2] - 0.01);
}

TEST(StandingRun, LawsAreTheirOwnFormulas) {
  for (const std::string law : {"pd_gravity", "feedforward_pd"}) {
    SCOPED_TRACE(law);
    ShippedRun run("stand", {"duration=1", "expect={}", "control.law=" + law, "control.stiffness=300",
                             "control.damping=10"});
    EXPECT_TRUE(Passes(run.Run()));
    EXPECT_EQ(run.loop().checks().Find("law_torque").count, 1000);
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

TEST(StandingRun, WhatDoesNotStandIsRefused) {
  EXPECT_THROW(ShippedRun("stand", {"stance.feet.0=fl_hand"}), InputError);
  EXPECT_THROW(ShippedRun("stand", {"plant.type=rigid"}), InputError);
  EXPECT_THROW(ShippedRun("panda-reach", {"stance={feet=['flange','flange','flange'],mu=0.5,f_max=100}"}),
               InputError);
}

}  // namespace
}  // namespace dexcheck::testing::standing_test
