#include "harness/scenario/scenario.h"

#include <gtest/gtest.h>

#include "controller/common/errors.h"
#include "harness/engine/mjcf_file.h"
#include "tests/common/files.h"
#include "tests/common/paths.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::scenario_test {
namespace {

TEST(ReadScenario, TurnsFrequencyAndDampingIntoGains) {
  const Scenario scenario = ReadShippedScenario(
      "paper", {"control.natural_frequency=[1, 2, 3, 4, 5, 6]", "control.damping_ratio=0.5"});
  EXPECT_EQ(scenario.control.gains.K_p[2], 9.0);
  EXPECT_EQ(scenario.control.gains.K_v[2], 3.0);
  EXPECT_THROW(ReadShippedScenario("paper", {"control.K_p=3"}), InputError) << "it has a frequency already";
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
