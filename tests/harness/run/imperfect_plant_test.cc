// A plant that is not ideal: what the scenario asks for is known to the checks.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "harness/injection/faulty_law.h"
#include "harness/run/runner.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::imperfect_plant_test {
namespace {

const std::vector<std::string> kShort = {"duration=0.2", "settle=0.3", "expect={}"};

std::vector<std::string> With(std::vector<std::string> base, const std::vector<std::string>& more) {
  base.insert(base.end(), more.begin(), more.end());
  return base;
}

std::string Push(const std::string& body) {
  return "disturbance=[{type='pulse',body='" + body +
         "',force=[1,2,3],torque=[0.1,0,0.2],begin=0.05,duration=0.05}]";
}

/// Something that a scenario may ask for.
struct Known {
  const char* name;
  std::vector<std::string> overrides;
  const char* scenario = "curve";
};
void PrintTo(const Known& known, std::ostream* out) { *out << known.name; }

const Known kKnown[] = {
    {"joint_counts", {"sensing.joint_counts=65536"}},
    {"joint_noise", {"sensing.joint_noise=1e-6"}},
    {"differenced", {"sensing.velocity=differenced", "sensing.velocity_cutoff=50"}},
    {"kalman", {"sensing.velocity=kalman", "sensing.kalman_acceleration=20", "sensing.joint_noise=1e-6"}},
    // The filter's rates of joints at rest are denormal numbers.
    {"kalman_of_joints_that_stick",
     {"sensing.velocity=kalman", "sensing.kalman_acceleration=20", "sensing.joint_counts=1048576",
      "actuation.coulomb=0.05"}},
    {"velocity_noise", {"sensing.velocity_noise=1e-4"}},
    {"noisy_rates_at_the_contacts", {"sensing.velocity_noise=1e-2"}},
    {"noisy_rates_of_the_object",
     {"sensing.object_velocity=kalman", "sensing.object_acceleration=5", "sensing.object_position_noise=1e-5",
      "sensing.velocity_noise=1e-3"}},
    {"noisy_rates_of_followed_contacts", {"control.kappa=integrated", "sensing.velocity_noise=1e-3"}},
    {"odometry", {"sensing.odometry=true"}},
    {"camera",
     {"sensing.object_rate=500", "sensing.object_latency=0.002", "sensing.object_velocity=kalman",
      "sensing.object_acceleration=5", "sensing.object_position_noise=1e-6"}},
    {"followed_contacts", {"duration=0.4", "control.kappa=integrated"}},
    {"sensing_latency", {"sensing.latency=0.002"}},
    {"latency_of_a_moving_start", {"sensing.latency=0.002", "sensing.odometry=true"}, "paper"},
    {"camera_of_a_moving_start",
     {"sensing.latency=0.001", "sensing.object_rate=250", "sensing.object_latency=0.003",
      "sensing.object_velocity=differenced"},
     "paper"},
    {"filtered_camera_of_a_moving_start",
     {"sensing.object_rate=250", "sensing.object_latency=0.003", "sensing.object_velocity=kalman",
      "sensing.object_acceleration=5", "sensing.object_position_noise=1e-6"},
     "paper"},
    {"idle_joints_of_pd", {"control.law=pd_gravity", "duration=0.6"}},
    {"torques_held_by_a_rigid_plant",
     {"plant.type=rigid", "duration=0.8", "expect.position=1e-7", "expect.orientation=1e-7"}},
    {"torque_step", {"actuation.torque_step=1e-3"}},
    {"gain_error", {"actuation.gain_error={ r_elbow = 0.02 }"}},
    {"lag", {"actuation.lag=1e-3"}},
    {"delay", {"actuation.delay=0.0015"}},
    {"friction", {"actuation.coulomb={ r_elbow = 0.1 }"}},
    {"backlash", {"actuation.backlash={ r_elbow = 1e-4 }"}},
    {"push_on_link",
     {"disturbance=[{ type = 'pulse', body = 'r_forearm', force = [0, 5, 0], begin = 0.05, duration = 0.05 "
      "}]"}},
    {"push_on_platform",
     {"disturbance=[{ type = 'pulse', body = 'platform', force = [0, 20, 0], begin = 0.05, duration = 0.05 "
      "}]"}},
    {"push_on_object",
     {"disturbance=[{ type = 'sine', body = 'object', force = [0, 0, 1], frequency = 10 }]"}},
    {"payload", {"disturbance=[{ type = 'payload', body = 'r_palm', mass = 0.2, at = [0, 0, 0.03] }]"}},
    {"slope", {"disturbance=[{ type = 'slope', slope_deg = [0.5, 0.2] }]"}},
    {"mass", {"mismatch.mass={ r_forearm = 1.05, object = 1.1 }"}},
    {"mass_within", {"mismatch.mass_within=0.03"}},
    {"com", {"mismatch.com={ r_forearm = [0.005, 0, 0] }"}},
    {"joint_constants", {"mismatch.damping=1.2", "mismatch.armature=0.9"}},
    {"errors_of_rotations", {"control.orientation=rotation"}},
    {"rates_of_wheels",
     {"model.base.velocity=wheel_rates", "control.weight={ platform = 0.005 }"},
     "paper-ramp"},
    {"arm",
     {"sensing={ joint_counts = 4096, velocity = 'differenced', velocity_cutoff = 60 }",
      "actuation={ delay = 0.002, torque_step = 0.01 }", "mismatch={ mass = 1.05 }",
      "disturbance=[{ type = 'step', body = 'panda_link5', force = [0, 2, 0] }]"},
     "panda-reach"},
    {"held_torques_of_an_arm", {"plant.control_step=0.004"}, "panda-reach"},
    // Robot and ground take up what is declared, wherever it acts.
    {"push_on_trunk", {Push("trunk")}, "stand"},
    {"push_on_shank", {Push("fl_shank")}, "stand"},
    {"sway",
     {"stance.points=[]", "stance.oscillations=[{axis='x',amplitude=0.03,frequency=1.5,ramp_time=1}]"},
     "stand"},
};

/// Declared in the scenario, the imperfection leaves nothing to find. Campaigns hide such, which are found.
class KnownCauses : public ::testing::TestWithParam<Known> {};

TEST_P(KnownCauses, CryNoWolf) {
  ShippedRun run(GetParam().scenario, With(kShort, GetParam().overrides), 1);
  const RunResult& result = run.Run();
  EXPECT_TRUE(Passes(result));
  for (const CheckRecord& check : run.loop().checks().motion_checks()) {
    EXPECT_FALSE(check.failed) << check.name << " " << check.worst << " at " << check.at;
  }
  for (const CheckRecord& check : run.loop().checks().model_checks()) {
    EXPECT_FALSE(check.failed) << check.name << " " << check.worst << " " << check.part;
  }
  // It does something: object or joints are no longer where the ideal plant has them.
  EXPECT_GT(result.tracking.position.max + result.tracking.joints.max, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(All, KnownCauses, ::testing::ValuesIn(kKnown),
                         [](const ::testing::TestParamInfo<Known>& info) { return info.param.name; });

/// Rates that are told need not fit together, and what the law demands is still known to rounding: a
/// thousandth of a part that does not vanish with the errors fails law_demand under noise as it does without.
TEST(KnownNoise, DoesNotBlindTheDemandOfTheLaw) {
  for (const char* part : {"mass matrix M_bar'", "object's wrench G^+ F_o"}) {
    for (const char* noise : {"sensing.velocity_noise=1e-2", "sensing.object_position_noise=1e-5"}) {
      SCOPED_TRACE(std::string(part) + " " + noise);
      ShippedRun run("curve", {"duration=0.02", "settle=0.3", "expect={}", noise}, 1);
      const ScenarioLaw law(run.setup());
      const auto entry = std::ranges::find_if(
          law.entries, [&](const LawEntry& one) { return one.parts != 0 && one.fault.starts_with(part); });
      ASSERT_NE(entry, law.entries.end());
      LoopParts wrong = MakeLoopParts(run.setup());
      wrong.follower = nullptr;
      wrong.controller = std::make_unique<FaultyLaw>(
          run.setup(), std::move(wrong.controller),
          LawFault{static_cast<size_t>(entry - law.entries.begin()), /*amplitude=*/1e-3});
      Runner runner(run.setup(), /*check=*/true, std::move(wrong));
      runner.Run([](const StepRecord&) {}, [] { return false; });
      EXPECT_TRUE(runner.loop().checks().Find("law_demand").failed)
          << runner.loop().checks().Find("law_demand").worst;
      EXPECT_FALSE(runner.loop().checks().Find("measurement").failed);
    }
  }
}

TEST(ImperfectPlant, WhatIsTooBadForTheExpectationIsStillSaid) {
  ShippedRun run("curve", {"duration=0.2", "settle=0.3", "mismatch.mass={ r_forearm = 1.2 }"});
  const RunResult& result = run.Run();
  EXPECT_EQ(result.verdict, Verdict::kDisagreement);
  EXPECT_TRUE(run.loop().checks().Find("expect_position").failed);
  EXPECT_FALSE(run.loop().checks().Find("inverse_dynamics_robot").failed);
}

TEST(ImperfectPlant, CurveRealDoesWhatItExpects) {
  ShippedRun run("curve-real", {"duration=3.3"});  // the first push included
  const RunResult& result = run.Run();
  EXPECT_TRUE(Passes(result));
  EXPECT_GT(result.tracking.position.max, 1e-4);
  EXPECT_GE(run.setup().scenario().imperfections.declared.size(), 6U);
}

TEST(ImperfectPlant, AMotorThatSaturatesGoesOnAndIsReported) {
  const std::vector<std::string> hard = {"duration=0.05", "settle=0.3", "control.natural_frequency=100",
                                         "start_error.xyz=[0, 0, 0.05]"};
  ShippedRun ends("curve", hard);
  EXPECT_THAT(ends.Run().failure, ::testing::HasSubstr("is at its limit"));
  ShippedRun goes_on("curve", With(hard, {"actuation.saturate=true"}));
  const RunResult& result = goes_on.Run();
  EXPECT_THAT(result.failure, ::testing::Not(::testing::HasSubstr("is at its limit")));
  EXPECT_EQ(result.attribution.cause, Cause::kActuatorLimit) << result.attribution.evidence;
  EXPECT_FALSE(goes_on.loop().checks().Find("torque_applied").failed);
}

}  // namespace
}  // namespace dexcheck::testing::imperfect_plant_test
