#include "harness/scenario/scenario.h"

#include <gtest/gtest.h>

#include "controller/common/errors.h"
#include "harness/engine/mjcf_file.h"
#include "tests/common/files.h"
#include "tests/common/paths.h"
#include "tests/common/throws.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::scenario_test {
namespace {

TEST(ReadScenario, ReadsEveryPart) {
  const Scenario scenario = ReadShippedScenario(
      "paper-rest", {"plant.floor_friction=0.5", "plant.control_step=0.004", "model.object.mass=0.25",
                     "control.weight={ platform = 3, arm = 2 }", "bounds.wheel_slip=0.5"});
  EXPECT_EQ(scenario.name, "paper-rest");
  EXPECT_EQ(scenario.start, Start::kRest);
  EXPECT_EQ(scenario.duration, 10.0);
  EXPECT_EQ(scenario.control.gains.K_p[0], 2.25);
  EXPECT_EQ(scenario.control.gains.K_v[5], 40.0);
  EXPECT_EQ(scenario.plant.floor_friction, 0.5);
  EXPECT_FALSE(scenario.plant.finger_friction);
  EXPECT_EQ(scenario.plant.control_step, 0.004);
  EXPECT_EQ(scenario.model_overrides, std::vector<std::string>{"object.mass=0.25"});
  EXPECT_EQ(scenario.control.weight, RedundancyWeight::Kind::kDiagonal);
  EXPECT_EQ(scenario.control.platform_weight, 3.0);
  ASSERT_EQ(scenario.bounds.size(), 1U);
  EXPECT_EQ(scenario.bounds[0].second, 0.5);
  EXPECT_EQ(scenario.grasp.fingertips.size(), 4U);
  EXPECT_DOUBLE_EQ(scenario.grasp.contacts[3].u, -kPi / 2.0);
}

TEST(ReadScenario, TurnsFrequencyAndDampingIntoGains) {
  const Scenario scenario = ReadShippedScenario(
      "paper", {"control.natural_frequency=[1, 2, 3, 4, 5, 6]", "control.damping_ratio=0.5"});
  EXPECT_EQ(scenario.control.gains.K_p[2], 9.0);
  EXPECT_EQ(scenario.control.gains.K_v[2], 3.0);
}

TEST(ReadScenario, ReadsWhatIsNotIdeal) {
  const Scenario scenario = ReadShippedScenario(
      "curve", {"sensing.joint_counts={ all = 4096, rf = 1024 }", "sensing.latency=0.002",
                "actuation.delay=0.0025", "actuation.saturate=true",
                "disturbance=[{ type = 'slope', slope_deg = [2, 0] }, { type = 'pulse', body = 'object', "
                "force = [0, 20, 0], begin = 1, duration = 0.1, frame = 'body' }]",
                "mismatch.mass_within=0.05", "mismatch.com={ r_forearm = [0.01, 0, 0] }"});
  const Imperfections& all = scenario.imperfections;
  EXPECT_FALSE(all.is_ideal());
  EXPECT_EQ(all.sensing.joint_counts.groups.size(), 2U);
  EXPECT_EQ(all.sensing.latency, 0.002);
  EXPECT_EQ(all.actuation.delay, 0.0025);
  EXPECT_TRUE(all.actuation.saturate);
  EXPECT_DOUBLE_EQ(all.mismatch.slope[0], DegToRad(2.0));
  ASSERT_EQ(all.disturbances.size(), 1U);
  EXPECT_EQ(all.disturbances[0].key, "disturbance.1");
  EXPECT_TRUE(all.disturbances[0].in_body_frame);
  EXPECT_EQ(all.mismatch.mass_within.all, 0.05);
  EXPECT_EQ(all.declared[1], "sensing.latency = 0.002");
  EXPECT_TRUE(ReadShippedScenario("curve").imperfections.is_ideal());
}

TEST(Scenario, AllMissingKeysAreReportedAtOnce) {
  const auto problem = [](const std::string& text) {
    try {
      ParseScenario(text, "new.toml", "", {});
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(problem("description = \"mine\""),
            "new.toml:1: missing key \"name\", \"duration\", \"start\", \"grasp\", \"control\", "
            "\"trajectory\"");
  // A value that is wrong as well is reported when nothing is missing any more.
  EXPECT_EQ(problem("name = \"mine\"\nsettle = 1e9"), "new.toml:1: missing key \"duration\", \"start\"");
}

struct BadInput {
  const char* name;
  std::vector<std::string> overrides;
  const char* message;
};

void PrintTo(const BadInput& bad, std::ostream* out) { *out << bad.name; }

class BadScenarios : public ::testing::TestWithParam<BadInput> {};

TEST_P(BadScenarios, AreRefusedInOneLine) {
  try {
    ShippedRun run("paper", GetParam().overrides);
    FAIL() << "was accepted";
  } catch (const InputError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find(GetParam().message), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

INSTANTIATE_TEST_SUITE_P(
    NotIdeal, BadScenarios,
    ::testing::Values(
        BadInput{"negative_noise",
                 {"sensing.joint_noise=-1e-3"},
                 "sensing.joint_noise: must not be negative, got -0.001"},
        BadInput{"negative_noise_of_a_group",
                 {"sensing.joint_noise={ rf = -1 }"},
                 "sensing.joint_noise.rf: must not be negative, got -1"},
        BadInput{"no_such_joint",
                 {"sensing.joint_noise={ r_elbov = 1 }"},
                 "sensing.joint_noise: fits no name of the robot (\"r_elbow\"?), got \"r_elbov\""},
        BadInput{"no_such_motor",
                 {"actuation.coulomb={ x = 1 }"},
                 "actuation.coulomb: fits no name of the robot, got \"x\""},
        BadInput{"long_latency",
                 {"sensing.latency=1.001"},
                 "sensing.latency: must be at most 1000 time steps, which the buffer holds, got 1.001"},
        BadInput{"long_delay",
                 {"actuation.delay=2"},
                 "actuation.delay: must be at most 1000 time steps, which the buffer holds, got 2"},
        BadInput{"half_a_sample",
                 {"sensing.latency=0.0015"},
                 "sensing.latency: must be a whole number of time steps, got 0.0015"},
        BadInput{"fast_camera",
                 {"sensing.object_rate=1500"},
                 "sensing.object_rate: must be at most one pose a time step, got 1500"},
        BadInput{"filter_without_size",
                 {"sensing.velocity=kalman"},
                 "sensing: missing key \"kalman_acceleration\""},
        BadInput{"unknown_source",
                 {"sensing.velocity=guessed"},
                 "sensing.velocity: must be one of \"measured\", \"differenced\", \"kalman\""},
        BadInput{"unknown_body",
                 {"disturbance=[{ type = 'step', body = 'r_forarm' }]"},
                 "disturbance.0.body: is no link of the robot and not the object (\"r_forearm\"?), got "
                 "\"r_forarm\""},
        BadInput{"pulse_without_end",
                 {"disturbance=[{ type = 'pulse', body = 'object' }]"},
                 "disturbance[0]: missing key \"duration\""},
        BadInput{"period_too_short",
                 {"disturbance=[{ type = 'pulse', body = 'object', duration = 1, period = 0.5 }]"},
                 "disturbance[0].period: must not be shorter than the duration, got 0.5"},
        BadInput{"payload_on_the_object",
                 {"disturbance=[{ type = 'payload', body = 'object', mass = 1 }]"},
                 "disturbance.0.body: is no link of the robot, got \"object\""},
        BadInput{
            "steep", {"disturbance=[{ type = 'slope', slope_deg = [31, 0] }]"}, "must be at most 30 degrees"},
        BadInput{"no_such_link",
                 {"mismatch.mass={ r_fore_arm = 1.05 }"},
                 "mismatch.mass: fits no name of the robot (\"r_forearm\"?), got \"r_fore_arm\""},
        BadInput{"massless", {"mismatch.mass=0"}, "mismatch.mass: must be positive, got 0"},
        BadInput{
            "too_random", {"mismatch.mass_within=1"}, "mismatch.mass_within: must be at most 0.99, got 1"},
        BadInput{"unknown_key", {"actuation.lags=1"}, "actuation.lags"}),
    [](const ::testing::TestParamInfo<BadInput>& info) { return info.param.name; });

INSTANTIATE_TEST_SUITE_P(
    All, BadScenarios,
    ::testing::Values(
        BadInput{"no_assignment", {"duration"}, "--set duration: must be PATH=VALUE"},
        BadInput{
            "negative_duration", {"duration=-1"}, "--set duration=-1: duration: must be positive, got -1"},
        BadInput{"endless_settling", {"settle=1e9"}, "--set settle=1e9: settle: must be at most 100 s"},
        BadInput{"settling_never", {"settle=inf"}, "settle: must be"},
        BadInput{"settling_in_tiny_steps",
                 {"plant.time_step=1e-9", "duration=1e-6"},
                 "settle: must be at most 1e8 time steps"},
        BadInput{"unknown_key",
                 {"plant.time_stop=1"},
                 "plant.time_stop: unknown key, did you mean \"time_step\"?"},
        BadInput{"unknown_table", {"plants.time_step=1"}, "plants: unknown key"},
        BadInput{"text_for_number", {"plant.impratio=much"}, "plant.impratio: must be a number"},
        BadInput{
            "path_through_number", {"duration.x=1"}, "--set duration.x=1: \"duration\" is no table or list"},
        BadInput{"no_such_entry", {"grasp.fingertips.7=rf1_tip"}, "is no entry of a list of 4"},
        BadInput{"no_such_fingertip", {"grasp.fingertips.0=rf9_tip"}, "\"rf9_tip\" is no fingertip"},
        BadInput{"fingertip_twice", {"grasp.fingertips.0=rf2_tip"}, "\"rf2_tip\" is named twice"},
        BadInput{"no_such_joint", {"grasp.joints_deg.elbow=3"}, "\"elbow\" is no joint"},
        BadInput{"no_such_frame", {"grasp.frame=palm"}, "\"palm\" is no frame"},
        BadInput{"too_few_contacts", {"grasp.contacts_deg=[[0, 0]]"}, "one contact for each of the 4"},
        BadInput{"out_of_reach", {"grasp.xyz=[0, 0, 0.5]"}, "do not reach their contacts"},
        BadInput{"gains_twice", {"control.K_p=3"}, "K_p"},
        BadInput{"force_bounds", {"control.f_max=0.5"}, "f_max: must be greater than f_min"},
        BadInput{"impedance", {"plant.contact_impedance=1"}, "contact_impedance: must be less than 1"},
        BadInput{"no_such_bound", {"bounds.slip=1"}, "bounds.slip: no check has this name"},
        BadInput{"bad_trajectory", {"trajectory.type=loop"}, "trajectory.type: must be one of"},
        BadInput{"unknown_law", {"control.law=pid"}, "control.law: must be one of"},
        BadInput{"law_without_stiffness",
                 {"control.stiffness=100"},
                 "control.stiffness: has no meaning for the law \"computed_torque\""},
        BadInput{"impedance_with_damping",
                 {"control.law=impedance", "control.damping=100"},
                 "control.damping: has no meaning for the law \"impedance\""},
        BadInput{"negative_stiffness",
                 {"control.law=pd_gravity", "control.stiffness=[1, 1, -1, 1, 1, 1]"},
                 "control.stiffness: must not be negative"},
        BadInput{"unknown_plant", {"plant.type=soft"}, "plant.type: must be one of"},
        BadInput{"engine_key_of_a_rigid_plant",
                 {"plant.type=rigid", "plant.impratio=3"},
                 "plant.impratio: has no meaning for a rigid plant"},
        BadInput{"model_value", {"model.object.mass=-1"}, "object.mass"},
        BadInput{"model_key", {"model.object.weight=1"}, "object.weight: unknown key"},
        BadInput{"singular_angles", {"grasp.zyz_deg=[90, -105, 0]"}, "take \"rotation\""}),
    [](const ::testing::TestParamInfo<BadInput>& info) { return info.param.name; });

TEST(ReadScenario, RefusesAMovingStartThatIsNoneBeforeItRuns) {
  EXPECT_THROW(ShippedRun("paper", {"trajectory.velocity=[0, 1, 0]"}), InputError);
  EXPECT_THROW(ShippedRun("paper", {"trajectory.turning=[0.1, 0, 0]"}), InputError);
}

TEST(ListMjcfFiles, FollowsIncludesAndAssets) {
  const std::vector<std::string> files = ListMjcfFiles(testing::SourcePath("/mjcf/scene.xml"));
  ASSERT_FALSE(files.empty());
  EXPECT_EQ(files[0], "scene.xml");
  for (const char* needed : {"robot.xml", "torus.xml", "stage.xml", "assets/torus.msh"}) {
    EXPECT_NE(std::find(files.begin(), files.end(), needed), files.end()) << needed;
  }
}

TEST(ListMjcfFiles, RefusesFilesFromElsewhere) {
  const TempFolder folder;
  WriteText(folder.path() / "a.xml",
            "<mujoco><!-- <include file=\"gone.xml\"/> --><include file=\"../b.xml\"/></mujoco>");
  WriteText(folder.path().parent_path() / "b.xml", "<mujoco/>");
  EXPECT_THROW(ListMjcfFiles(folder.path() / "a.xml"), InputError);
  std::filesystem::remove(folder.path().parent_path() / "b.xml");
  for (const char* file : {"sub/../../b.xml", "/b.xml", "sub/../.."}) {
    WriteText(folder.path() / "a.xml",
              std::string("<mujoco><asset><mesh file=\"") + file + "\"/></asset></mujoco>");
    EXPECT_THROW(ListMjcfFiles(folder.path() / "a.xml"), InputError) << file;
    WriteText(folder.path() / "a.xml", std::string("<mujoco><include file=\"") + file + "\"/></mujoco>");
    EXPECT_THROW(ListMjcfFiles(folder.path() / "a.xml"), InputError) << file;
  }
}

// Text of any length and depth, and XML as it may be written: other quotes, order, blanks, marks in values.
TEST(ListMjcfFiles, ReadsAnyXml) {
  const TempFolder folder;
  std::string vertices;
  for (int i = 0; i < 300000; ++i) vertices += "0.25 ";
  WriteText(folder.path() / "a.xml",
            "<mujoco>\n<compiler texturedir='looks' meshdir=\n\"shapes\"/><asset>\n"
            "<mesh name=\"a > b\" vertex=\"" +
                vertices +
                "\"/>\n"
                "<mesh scale='1 1 1'\n file = 'x &amp; y.stl' name=\"<include file='no.xml'>\"/>\n"
                "<hfield file=\"h.png\"/><texture fileright=\"r.png\" fileleft=\"l.png\"/></asset>\n"
                "<worldbody><body><body><include file=\"b.xml\"></include></body></body></worldbody>\n"
                "<!-- <include file=\"gone.xml\"/> --><![CDATA[<mesh file=\"gone.stl\"/>]]></mujoco>");
  WriteText(folder.path() / "b.xml", "<mujocoinclude><skin file=\"s.skn\"/></mujocoinclude>");
  std::filesystem::create_directories(folder.path() / "looks");
  std::filesystem::create_directories(folder.path() / "shapes");
  for (const char* file :
       {"looks/l.png", "looks/r.png", "shapes/h.png", "shapes/s.skn", "shapes/x & y.stl", "shapes/x.stl"}) {
    WriteText(folder.path() / file, "");
  }
  EXPECT_EQ(ListMjcfFiles(folder.path() / "a.xml"),
            (std::vector<std::string>{"a.xml", "b.xml", "looks/l.png", "looks/r.png", "shapes/h.png",
                                      "shapes/s.skn", "shapes/x & y.stl"}));

  WriteText(folder.path() / "stripped.xml",
            "<mujoco><compiler strippath=\"true\" meshdir=\"shapes\"/><asset><mesh "
            "file=\"../far/x.stl\"/></asset></mujoco>");
  EXPECT_EQ(ListMjcfFiles(folder.path() / "stripped.xml"),
            (std::vector<std::string>{"stripped.xml", "shapes/x.stl"}));

  std::string deep;
  for (int i = 0; i < 100000; ++i) deep += "<body>";
  for (const std::string& broken : {deep, std::string("<mujoco><mesh file=\"a\""), std::string()}) {
    WriteText(folder.path() / "broken.xml", broken);
    EXPECT_THROW(ListMjcfFiles(folder.path() / "broken.xml"), InputError) << broken.size();
  }
}

}  // namespace
}  // namespace dexcheck::testing::scenario_test
