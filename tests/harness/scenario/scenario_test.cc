#include "harness/scenario/scenario.h"

#include <gtest/gtest.h>

#include "controller/common/errors.h"
#include "harness/engine/mjcf_file.h"
#include "tests/common/files.h"
#include "tests/common/paths.h"
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
  EXPECT_THROW(ReadShippedScenario("paper", {"control.K_p=3"}), InputError) << "it has a frequency already";
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
