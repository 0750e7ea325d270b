// dexcheck init of a URDF alone: rates and legs.

#include <string>
#include <tuple>

#include "harness/log/log_reader.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::init_urdf_test {
namespace {

using InitUrdf = CommandTest;

// The motion that is written keeps the rates that the URDF allows, and ends at rest.
TEST_F(InitUrdf, MovesAsFastAsJointsMay) {
  WriteChanged("slow.urdf", ReadFixture("pair.urdf"), "upper=\"2\" effort=\"1\" velocity=\"1\"",
               "upper=\"2\" effort=\"1\" velocity=\"0.05\"");
  Expect(0, "init slow.urdf");
  Expect(0, "run slow/motion.toml --no-report --out run");
  const LogReader log(Path("run/log.h5"));
  const RowMatrixXd rates = log.ReadSignal("xi");
  const VectorXd fastest = rates.cwiseAbs().colwise().maxCoeff();
  EXPECT_LT(fastest[0], 0.05);
  EXPECT_GT(fastest[0], 0.02);
  EXPECT_GT(fastest[1], 0.2);
  EXPECT_LT(rates.bottomRows(1).cwiseAbs().maxCoeff(), 1e-3 * fastest[0]);
}

// Names are those of the file, as URDF and MJCF allow them.
TEST_F(InitUrdf, PartsMayHaveAnyName) {
  std::string text =
      ReplaceOnce(ReadFixture("pair.urdf"), "joint name=\"elbow\"", "joint name=\"left/elbow 2\"");
  text = ReplaceOnce(text, "link name=\"lower\"", "link name=\"left/lower\"");
  WriteChanged("names.urdf", text, "child link=\"lower\"", "child link=\"left/lower\"");
  Expect(0, "init names.urdf");
  Expect(0, {"run", "names/motion.toml", "--no-log", "--set", "settle=0.1", "--set",
             "disturbance=[{type='pulse',body='left/lower',force=[1,0,0],begin=0.1,duration=0.1}]"});
}

/// A URDF of a trunk on four legs of three joints, with a ball for a foot.
std::string MakeLeggedUrdf(const std::string& head) {
  const auto link = [](const std::string& name, double mass, const std::string& more) {
    return "<link name=\"" + name + "\"><inertial><mass value=\"" + std::to_string(mass) +
           "\"/><inertia ixx=\"0.01\" iyy=\"0.01\" izz=\"0.01\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>" +
           more + "</link>\n";
  };
  std::string text = "<robot name=\"legged\">\n" + head + link("trunk", 8.0, "");
  for (const char* leg : {"0.2 0.1", "0.2 -0.1", "-0.2 0.1", "-0.2 -0.1"}) {
    const std::string name = leg;
    std::string parent = "trunk", place = name + " 0";
    for (const auto& [part, axis, next] : {std::tuple("hip", "1 0 0", "0 0 0"),
                                           {"thigh", "0 1 0", "0 0 -0.2"},
                                           {"shank", "0 1 0", "0 0 -0.2"}}) {
      const bool ends = std::string(part) == "shank";
      text += link(part + name, 0.5,
                   ends ? "<collision><origin xyz=\"0 0 -0.2\"/><geometry><sphere "
                          "radius=\"0.02\"/></geometry></collision>"
                        : "");
      text += "<joint name=\"" + (part + name) + "\" type=\"revolute\"><parent link=\"" + parent +
              "\"/><child link=\"" + part + name + "\"/><origin xyz=\"" + place + "\"/><axis xyz=\"" + axis +
              "\"/><limit lower=\"" + (ends ? "-2.5" : "-1") + "\" upper=\"" + (ends ? "0" : "1.5") +
              "\" effort=\"40\" velocity=\"10\"/></joint>\n";
      parent = part + name;
      place = next;
    }
  }
  return text + "</robot>\n";
}

// A URDF does not say that its base floats: legs do.
TEST_F(InitUrdf, AUrdfWithLegsAloneStands) {
  Write("legged.urdf", MakeLeggedUrdf(""));
  const ProgramResult said = Expect(0, "init legged.urdf");
  EXPECT_THAT(said.err, HasSubstr("floats, on 4 legs"));
  EXPECT_THAT(said.err, Not(HasSubstr("held")));
  EXPECT_THAT(said.out, HasSubstr("wrong in both"));
  EXPECT_THAT(Read("legged/robot.xml"), HasSubstr("freejoint"));
  EXPECT_THAT(Read("legged/motion.toml"), HasSubstr(R"(feet = ["foot_1", "foot_2", "foot_3", "foot_4"])"));
  const Json run = RunJson(0, {"run", "legged/motion.toml", "--no-log", "--set", "settle=0.1"});
  EXPECT_EQ(run.at("verdict"), "pass");
  EXPECT_GT(run.at("checks").at("foot_cone_use").at("max").get<double>(), 0.0);
  // What hangs on the world does not.
  Write("hangs.urdf", MakeLeggedUrdf("<link name=\"world\"/><joint name=\"weld\" type=\"fixed\">"
                                     "<parent link=\"world\"/><child link=\"trunk\"/></joint>\n"));
  EXPECT_THAT(Expect(0, "init hangs.urdf").err, Not(HasSubstr("floats")));
  EXPECT_THAT(Read("hangs/motion.toml"), HasSubstr("[joint_motion]\nstart"));
}

}  // namespace
}  // namespace dexcheck::testing::init_urdf_test
