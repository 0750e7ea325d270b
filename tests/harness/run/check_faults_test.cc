// Every check of a run can fail: a fault seeded for each, and what cannot be asked is not said to be good.

#include <gmock/gmock.h>

#include <set>

#include "harness/plant/engine_plant.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::check_faults_test {
namespace {

const std::string kRobot = SourcePath("/controller/parameters/assistant_robot.toml");

/// What makes a check fail.
struct CheckFault {
  const char* check;
  const char* scenario;
  std::vector<std::string> overrides;
  void (*change)(mjModel*) = nullptr;  ///< Of the plant besides, beyond what a scenario can.
};

void PrintTo(const CheckFault& fault, std::ostream* out) { *out << fault.check; }

/// One iteration of the solver instead of as many as it needs.
void StopSolverEarly(mjModel* m) { m->opt.iterations = 1; }

/// The object bounces on what it lies on.
void RemoveDampingOfObject(mjModel* m) {
  const int object = mj_name2id(m, mjOBJ_BODY, "torus");
  for (int pair = 0; pair < m->npair; ++pair) {
    const bool touches =
        m->geom_bodyid[m->pair_geom1[pair]] == object || m->geom_bodyid[m->pair_geom2[pair]] == object;
    if (touches) m->pair_solref[mjNREF * pair + 1] = 0.05;
  }
}

/// Fingers of the left hand, 10 mm apart, push each other from 10.5 mm on.
void ThickenLeftFingers(mjModel* m) {
  const auto is_left_finger = [m](int geom) {
    return NameOf(*m, mjOBJ_BODY, m->geom_bodyid[geom]).rfind("lf", 0) == 0;
  };
  for (int pair = 0; pair < m->npair; ++pair) {
    const bool both = is_left_finger(m->pair_geom1[pair]) && is_left_finger(m->pair_geom2[pair]);
    if (both) m->pair_margin[pair] = 0.0105;
  }
}

/// One fingertip is 1 % larger.
void ThickenFingertip(mjModel* m) {
  const int body = mj_name2id(m, mjOBJ_BODY, "rf1_phalanx_4");
  for (int geom = 0; geom < m->ngeom; ++geom)
    if (m->geom_bodyid[geom] == body && m->geom_type[geom] == mjGEOM_SPHERE) m->geom_size[3 * geom] *= 1.01;
}

/// The same of a quadruped's foot.
void ThickenFoot(mjModel* m) {
  const int geom = mj_name2id(m, mjOBJ_GEOM, "fl_foot_geom");
  m->geom_size[3 * geom] *= 1.01;
}

const std::vector<std::string> kSoft = {"duration=0.02", "plant.contact_time_constant=0.05",
                                        "plant.contact_impedance=0.5"};
const std::vector<std::string> kSlippery = {"duration=0.1", "plant.finger_friction=0.15"};
const std::vector<std::string> kShort = {"duration=0.05"};
const std::vector<std::string> kSwaying = {
    "duration=0.6", "expect={}", "stance.points=[]", "plant.floor_friction=0.15",
    "stance.oscillations=[{axis='x',amplitude=0.03,frequency=1.5,ramp_time=1}]"};

const CheckFault kFaults[] = {
    {"inverse_dynamics_robot",
     "hold",
     {"duration=0.02", "model.template.arm.links.forearm.shapes.0.mass=1.5"}},
    {"inverse_dynamics_object", "hold", {"duration=0.02", "model.object.mass=0.21"}},
    {"contact_distance", "hold", {"duration=0.02"}, ThickenFingertip},
    {"reduced_acceleration", "hold", kSoft},
    {"contact_force", "hold", kSoft},
    {"fingertip_slip", "hold", kSlippery},
    {"fingertip_slip_rate", "hold", {"duration=0.02", "plant.impratio=1"}},
    {"wheel_slip", "paper-rest", kShort},
    {"wheel_slip_rate", "paper-rest", kShort},
    {"rolling", "paper-ramp", {"duration=1", "settle=0.3", "model.base.wheel_radius=0.1002"}},
    {"cone_use", "hold", kSlippery},
    {"traction_use", "paper-rest", kShort},
    {"contacts_lost", "hold", kSlippery},
    {"penetration", "hold", kSoft},
    {"kappa", "hold", kSoft},
    {"base_tilt", "paper-rest", kShort},
    {"idle_joints", "paper-rest", kShort},
    {"solver", "hold", {"duration=0.02"}, StopSolverEarly},
    {"joint_limit", "hold", {"duration=0.02", "model.template.arm.joints.elbow.range=[-0.1, 1.4]"}},
    {"clearance", "hold", {"duration=0.02", "grasp.joints_deg.l_shoulder_roll=-20"}},
    {"collision", "hold", {"duration=0.02", "plant.collide=true"}, ThickenLeftFingers},
    {"excluded",
     "lift",
     {"duration=0.6", "settle=0.01", "task.xyz=[0.25, -0.5, 0.6335]", "plant.contact_time_constant=0.02"},
     RemoveDampingOfObject},
    {"foot_slip", "stand", kSwaying},
    {"foot_slip_rate", "stand", kSwaying},
    {"foot_cone_use", "stand", kSwaying},
    {"feet_lost", "stand", kSwaying},
    {"foot_penetration",
     "stand",
     {"duration=0.02", "expect={}", "plant.contact_time_constant=0.05", "plant.contact_impedance=0.5"}},
    {"foot_distance", "stand", {"duration=0.02", "expect={}"}, ThickenFoot},
    {"actuator_effort", "offset", {"duration=0.05", "start_error.xyz=[0, 0, 0.3]"}},
};

class CheckFaults : public ::testing::TestWithParam<CheckFault> {};

TEST_P(CheckFaults, FailTheirCheck) {
  const CheckFault& fault = GetParam();
  const Scenario scenario = ReadShippedScenario(fault.scenario, fault.overrides);
  const std::string mjcf = scenario.mjcf_file.empty() ? SourcePath("/mjcf/scene.xml") : scenario.mjcf_file;
  const dexcheck::Setup setup(scenario, scenario.model_file.empty() ? kRobot : scenario.model_file, mjcf);
  LoopParts parts = MakeLoopParts(setup);
  // Of the simulation alone, after the scenario has set what it sets.
  if (fault.change != nullptr) dynamic_cast<EnginePlant&>(*parts.plant).simulation().Change(fault.change);
  Runner runner(setup, /*check=*/true, std::move(parts));
  const RunResult& result = runner.Run([](const StepRecord&) {}, [] { return false; });
  const CheckRecord& check = runner.loop().checks().Find(fault.check);
  EXPECT_TRUE(check.failed) << check.worst << " of " << check.bound << "; " << result.failure;
  EXPECT_NE(result.verdict, Verdict::kPass);
  EXPECT_NE(result.attribution.cause, Cause::kNone);
}

INSTANTIATE_TEST_SUITE_P(All, CheckFaults, ::testing::ValuesIn(kFaults),
                         [](const auto& info) { return std::string(info.param.check); });

TEST(CheckFaults, AreThereForEveryCheck) {
  std::set<std::string> seeded;
  for (const CheckFault& fault : kFaults) seeded.insert(fault.check);
  std::set<std::string> checks;
  // Those of the law are in law_check_test, that of hemispheres in fingertip_rim_test.
  for (const CheckInfo& info : ListChecks()) {
    if (info.category != CheckCategory::kLaw && info.name != "fingertip_rim") checks.emplace(info.name);
  }
  EXPECT_EQ(seeded, checks);
}

std::set<std::string> ListApplying(const ShippedRun& run) {
  std::set<std::string> names;
  for (const std::span<const CheckRecord> checks :
       {run.loop().checks().model_checks(), run.loop().checks().motion_checks()}) {
    for (const CheckRecord& check : checks) {
      if (check.applies) names.insert(check.name);
    }
  }
  return names;
}

TEST(CheckFaults, WhatARunCannotAskIsNotPrinted) {
  using ::testing::Contains;
  using ::testing::Not;
  const std::set<std::string> hold = ListApplying(ShippedRun("hold"));
  EXPECT_THAT(hold, Contains("object_pose"));
  EXPECT_THAT(hold, Not(Contains("excluded")));
  const std::set<std::string> lift = ListApplying(ShippedRun("lift"));
  EXPECT_THAT(lift, Contains("excluded"));
  // With the rotation itself as feedback nothing is made of the pose that was measured.
  EXPECT_THAT(lift, Not(Contains("object_pose")));
  EXPECT_THAT(lift, Not(Contains("V_Bo")));
  const std::set<std::string> bonded = ListApplying(ShippedRun("bonded"));
  for (const char* name : {"cone_use", "kappa", "contact_frame", "fingertip_slip_rate"})
    EXPECT_THAT(bonded, Not(Contains(name)));
  // Both arms carry.
  const std::set<std::string> both = ListApplying(ShippedRun("two-hands"));
  EXPECT_THAT(both, Not(Contains("idle_joints")));
}

// Contacts creep for ever, so what is judged must not depend on how long a run is.
TEST(SlipWindow, ForgetsWhatWasLongAgo) {
  ShippedRun run("hold", {"duration=16", "settle=0.5", "plant.time_step=2e-3"});
  const RunResult& result = run.Run();
  EXPECT_EQ(result.verdict, Verdict::kPass) << result.attribution.evidence;
  const SlipState& slip = run.step().findings.fingertip_slip[0];
  const CheckRecord& check = run.loop().checks().Find("fingertip_slip");
  // Windows begin at 0 until t = 10 s, at 5 s until 15 s, then at 10 s.
  EXPECT_GT(check.worst, 1e-6);
  EXPECT_NEAR(check.at, 10.0, 5.1);
  EXPECT_NEAR(check.last / check.worst, 0.6, 0.01);
  // What is recorded goes on from t = 0.
  EXPECT_NEAR((slip.distance - slip.window).norm() / slip.distance.norm(), 6.0 / 16.0, 0.01);
}

}  // namespace
}  // namespace dexcheck::testing::check_faults_test
