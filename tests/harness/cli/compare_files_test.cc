// dexcheck consistency and diagnose of two files: what only one of them has, what cannot be compared, what is
// the engine's own, and which difference comes first.

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/common/matchers.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::compare_files_test {
namespace {

using Json = nlohmann::json;

const std::string kUrdf = R"(<robot name="two links">
<link name="stand"/>
<link name="upper"><inertial><origin xyz="0.1 0.02 0"/><mass value="1.5"/>
  <inertia ixx="0.01" iyy="0.02" izz="0.022" ixy="0.001" ixz="0.0005" iyz="-0.002"/></inertial></link>
<link name="lower"><inertial><origin xyz="0.1 0 0"/><mass value="0.8"/>
  <inertia ixx="0.01" iyy="0.011" izz="0.012" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="stand"/><child link="upper"/>
  <origin xyz="0 0 0.1"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
  <origin xyz="0.3 0 0"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
</robot>
)";

const std::string kMjcf = R"(<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <body name="upper" pos="0 0 0.1">
      <joint name="shoulder" axis="0 0 1" limited="true" range="-2 2"/>
      <inertial pos="0.1 0.02 0" mass="1.5" fullinertia="0.01 0.02 0.022 0.001 0.0005 -0.002"/>
      <body name="lower" pos="0.3 0 0">
        <joint name="elbow" axis="0 1 0" limited="true" range="-1 1"/>
        <inertial pos="0.1 0 0" mass="0.8" diaginertia="0.01 0.011 0.012"/>
      </body>
    </body>
  </worldbody>
</mujoco>
)";

class CompareFiles : public ::testing::Test {
 protected:
  CompareFiles() {
    Write("a.urdf", kUrdf);
    Write("b.xml", kMjcf);
  }

  void Write(const std::string& name, const std::string& text) const {
    WriteText(folder_.path() / name, text);
  }
  [[nodiscard]] ProgramResult Run(const std::vector<std::string>& arguments) const {
    return testing::RunDexcheck(arguments, {folder_.path()});
  }
  /// The results of a comparison, which must end so.
  Json Compare(const std::string& a, const std::string& b, int exit_code,
               std::vector<std::string> more = {}) const {
    std::vector<std::string> arguments = {"consistency", a, b, "--samples", "200", "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramResult result = Run(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << a << " " << b << ": " << result.out << result.err;
    return Json::parse(result.out);
  }

  testing::TempFolder folder_;
};

TEST_F(CompareFiles, WhatOneAloneHasIsADisagreementUnlessItIsIgnored) {
  struct Addition {
    const char* attribute;
    const char* word;
    const char* check;
    double value;
    const char* effect;  // of I = 0.011 + 0.8 * 0.1^2 about the axis
  };
  for (const Addition& addition :
       {Addition{"armature=\"0.01\"", "armature", "joint_armature", 0.01, "53 %"},
        {"damping=\"0.3\"", "damping", "joint_damping", 0.3, "0.063 s"},
        {"frictionloss=\"0.1\"", "friction", "joint_dry_friction", 0.1, "5.3 rad/s^2"}}) {
    SCOPED_TRACE(addition.word);
    Write("more.xml",
          ReplaceOnce(kMjcf, "range=\"-1 1\"", "range=\"-1 1\" " + std::string(addition.attribute)));
    const Json results = Compare("a.urdf", "more.xml", 1);
    ASSERT_EQ(results.at("findings").size(), 1U);
    const Json& finding = results.at("findings").front();
    EXPECT_EQ(finding.at("check"), addition.check);
    EXPECT_EQ(finding.at("model"), 0.0);
    EXPECT_EQ(finding.at("engine"), addition.value);
    EXPECT_THAT(finding.at("effect"), HasSubstr(addition.effect));
    // Of everything else nothing is hidden by it.
    for (const auto& [name, check] : results.at("checks").items())
      EXPECT_EQ(check.at("pass"), name != addition.check) << name;

    const Json ignored = Compare("a.urdf", "more.xml", 0, {"--ignore", "armature,damping,friction"});
    EXPECT_FALSE(ignored.at("checks").contains(addition.check));
    EXPECT_THAT(ignored.at("not_compared"),
                ::testing::Contains(HasSubstr(std::string(addition.word) + ": ignored, though")));
    // A table states all, and is judged so too.
    ASSERT_EQ(Run({"import", "a.urdf", "--out", "a.toml"}).exit_code, 0);
    Compare("a.toml", "more.xml", 1);
    Compare("a.toml", "more.xml", 0, {"--ignore", addition.word});
    // Its repair is the diagnosis, where motion shows it.
    const ProgramResult diagnosis = Run({"diagnose", "a.urdf", "more.xml", "--json"});
    EXPECT_EQ(diagnosis.exit_code, 1);
    EXPECT_EQ(Json::parse(diagnosis.out).at("causes").size(), 1U) << diagnosis.out;
    EXPECT_EQ(Run({"diagnose", "a.urdf", "more.xml", "--ignore", addition.word}).exit_code, 0);
  }
  EXPECT_EQ(Run({"consistency", "a.urdf", "b.xml", "--ignore", "gravity"}).exit_code, 2);
}

TEST_F(CompareFiles, AJointThatFollowsAnotherIsADisagreementUnlessItIsIgnored) {
  Write("mimic.urdf", ReplaceOnce(kUrdf, "<origin xyz=\"0.3 0 0\"/>",
                                  "<origin xyz=\"0.3 0 0\"/><mimic joint=\"shoulder\" multiplier=\"0.5\"/>"));
  Write("tied.xml", ReplaceOnce(kMjcf, "</worldbody>",
                                "</worldbody><equality><joint joint1=\"elbow\" joint2=\"shoulder\" "
                                "polycoef=\"0 0.5 0 0 0\"/></equality>"));
  Compare("mimic.urdf", "tied.xml", 0);
  for (const auto& [a, b, check] : {std::tuple("mimic.urdf", "b.xml", "joint_coupling"),
                                    {"mimic.urdf", "a.urdf", "joint_coupling"},
                                    {"a.urdf", "tied.xml", "equality_constraint"}}) {
    const Json results = Compare(a, b, 1);
    ASSERT_EQ(results.at("findings").size(), 1U) << a << b;
    EXPECT_EQ(results.at("findings").front().at("check"), check);
    EXPECT_THAT(Compare(a, b, 0, {"--ignore", "coupling"}).at("not_compared"),
                ::testing::Contains("coupling: ignored"));
  }
}

// Both ways to name two files, in both orders, are one.
TEST_F(CompareFiles, OneWayLeadsToEachAnswer) {
  ASSERT_EQ(Run({"import", "a.urdf", "--out", "a.toml"}).exit_code, 0);
  const std::vector<std::string> files = {"a.urdf", "b.xml", "a.toml"};
  for (const std::string& a : files) {
    for (const std::string& b : files) {
      Json placed = Compare(a, b, 0);
      Json named =
          Json::parse(Run({"consistency", "--robot", a, "--mjcf", b, "--samples", "200", "--json", "-"}).out);
      for (Json* const results : {&placed, &named}) results->erase("seconds");
      EXPECT_EQ(placed, named) << a << " " << b;
    }
  }
}

TEST_F(CompareFiles, FramesOfLinksAreAlwaysThereToCompare) {
  ASSERT_EQ(Run({"import", "a.urdf", "--out", "a.toml"}).exit_code, 0);
  for (const char* const a : {"a.urdf", "a.toml"}) {
    for (const char* const b : {"b.xml", "a.urdf"}) {
      const Json results = Compare(a, b, 0);
      for (const char* const term : {"frame_pose", "J", "J_dot_xi"}) {
        ASSERT_TRUE(results.at("checks").contains(term)) << a << b << term;
        EXPECT_GT(results.at("checks").at(term).at("compared"), 0);
      }
    }
  }
  // A table whose bodies and sites have other names has them, too.
  Write("table.toml", testing::kTwoLinksToml);
  Write("names.xml", ReplaceOnce(ReplaceOnce(testing::kTwoLinksMjcf, "body name=\"lower\"", "body"),
                                 "site name=\"tip\"", "site name=\"top\""));
  EXPECT_THAT(Compare("table.toml", "names.xml", 0).at("not_compared"),
              ::testing::Contains(HasSubstr("frames only in table.toml: tip")));
  // And they are compared: a body that turns about another place.
  Write("wrong.xml", ReplaceOnce(kMjcf, "pos=\"0.3 0 0\"", "pos=\"0.3 0.01 0.01\""));
  const Json wrong = Compare("a.urdf", "wrong.xml", 1);
  for (const char* const term : {"frame_pose", "J", "J_dot_xi"})
    EXPECT_FALSE(wrong.at("checks").at(term).at("pass")) << term;
}

// Principal moments 0.01, 0.011, 0.03: published robots have such links.
TEST_F(CompareFiles, ABodyThatNoneCanBeIsComparedAndNoted) {
  Write("a.urdf", ReplaceOnce(kUrdf, "izz=\"0.012\"", "izz=\"0.03\""));
  ASSERT_EQ(Run({"import", "a.urdf", "--out", "a.toml"}).exit_code, 0);
  Write("b.xml", ReplaceOnce(ReplaceOnce(kMjcf, "0.01 0.011 0.012", "0.01 0.011 0.03"), "angle=\"radian\"",
                             "angle=\"radian\" balanceinertia=\"true\""));
  const auto is_noted = ::testing::Contains(::testing::AllOf(HasSubstr("triangle"), HasSubstr("lower")));
  for (const char* const b : {"a.urdf", "a.toml"}) EXPECT_THAT(Compare("a.urdf", b, 0).at("notes"), is_noted);
  for (const char* const a : {"a.urdf", "a.toml"}) {
    const Json balanced = Compare(a, "b.xml", 1);
    EXPECT_THAT(balanced.at("notes"), is_noted);
    EXPECT_FALSE(balanced.at("checks").at("link_inertia").at("pass"));
    EXPECT_THAT(balanced.at("checks").at("link_inertia").at("where"), HasSubstr("lower"));
    const ProgramResult audit = Run({"audit", a, "--json"});
    EXPECT_EQ(audit.exit_code, 1);
    EXPECT_EQ(Json::parse(audit.out).at("findings").at(0).at("level"), "impossible");
  }
}

// Of this chain's axes the table's angles leave 1.1e-14.
TEST_F(CompareFiles, ATableThatWasImportedAgreesWithWhatItIsOf) {
  Write("turned.urdf", R"(<robot name="r"><link name="b"/>
<link name="l0"><inertial><mass value="0.77"/>
  <inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="l1"><inertial><mass value="0.52"/>
  <inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j0" type="continuous"><parent link="b"/><child link="l0"/>
  <origin xyz="0.035309 0.035495 -0.076471" rpy="-1.309278 -2.670774 -1.556142"/><axis xyz="0 0 1"/></joint>
<joint name="j1" type="continuous"><parent link="l0"/><child link="l1"/>
  <origin xyz="-0.018030 -0.011781 0.008361" rpy="2.026017 2.110552 -2.83005"/><axis xyz="0 1 0"/></joint>
</robot>)");
  ASSERT_EQ(Run({"import", "turned.urdf", "--out", "turned.toml"}).exit_code, 0);
  const Json imported = Compare("turned.urdf", "turned.toml", 0);
  constexpr double kBound = 3.0 * 16.0 * 2.220446049250313e-16;  // of a URDF against itself, d = 2
  const Json itself = Compare("turned.urdf", "turned.urdf", 0);
  EXPECT_DOUBLE_EQ(itself.at("checks").at("joint_axis").at("bound"), kBound);
  EXPECT_GT(imported.at("checks").at("joint_axis").at("max"), kBound);
}

// A slender body, whose principal axes MuJoCo finds to 1e-8 at best.
TEST_F(CompareFiles, WhatTheEngineMakesOfFullinertiaIsItsOwn) {
  const Json results = Compare("a.urdf", "b.xml", 0);
  EXPECT_THAT(results.at("notes"),
              ::testing::Contains(::testing::AllOf(HasSubstr("fullinertia"), HasSubstr("upper"))));
  const Json diagnosis = Json::parse(Run({"diagnose", "a.urdf", "b.xml", "--json"}).out);
  EXPECT_EQ(diagnosis.at("verdict"), "pass");
  EXPECT_TRUE(diagnosis.at("causes").empty());
  EXPECT_FALSE(diagnosis.at("notes").empty());
  // A number that differs is none of the engine's.
  Write("wrong.urdf", ReplaceOnce(kUrdf, "ixy=\"0.001\"", "ixy=\"0.001001\""));
  EXPECT_FALSE(Compare("wrong.urdf", "b.xml", 1).at("checks").at("link_inertia").at("pass"));
}

TEST_F(CompareFiles, ARealDifferenceIsInTheFirstLine) {
  std::string text = kUrdf;
  text = ReplaceOnce(text, "value=\"0.8\"", "value=\"0.800001\"");  // as printed
  text = ReplaceOnce(text, "upper=\"2\"", "upper=\"2.000001\"");
  Write("rounded.urdf", text);
  const ProgramResult rounded = Run({"consistency", "rounded.urdf", "a.urdf", "--samples", "20", "--quiet"});
  EXPECT_EQ(rounded.exit_code, 1);
  EXPECT_THAT(rounded.out, ::testing::StartsWith("DISAGREE: everything agrees to 5 digits"));
  Write("wrong.urdf", ReplaceOnce(text, "upper=\"1\" ", "upper=\"1.5\" "));
  const ProgramResult wrong = Run({"consistency", "wrong.urdf", "a.urdf", "--samples", "20", "--quiet"});
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_THAT(wrong.out.substr(0, wrong.out.find('\n')),
              ::testing::AllOf(HasSubstr("joint_range: joint elbow"), HasSubstr("1.5 in wrong.urdf"),
                               HasSubstr("everything else agrees to 5 digits")));
}

TEST_F(CompareFiles, PartsWithoutANameGetOne) {
  Write("nameless.urdf", ReplaceOnce(kUrdf, "joint name=\"shoulder\"", "joint name=\"\""));
  Write("nameless.xml", ReplaceOnce(kMjcf, "joint name=\"shoulder\"", "joint"));
  EXPECT_THAT(Compare("nameless.urdf", "nameless.xml", 0).at("notes"),
              ::testing::Contains(::testing::AllOf(HasSubstr("\"#0\""), HasSubstr("upper"))));
  ASSERT_EQ(Run({"import", "nameless.urdf", "--out", "nameless.toml"}).exit_code, 0);
  Compare("nameless.toml", "nameless.urdf", 0);
  // A free body, too.
  Write("free.xml", ReplaceOnce(kMjcf, "<body name=\"upper\" pos=\"0 0 0.1\">",
                                "<body pos=\"0 0 1\"><freejoint/><inertial pos=\"0 0 0\" mass=\"1\" "
                                "diaginertia=\"1 1 1\"/><body name=\"upper\" pos=\"0 0 0.1\">"));
  Write("free.xml",
        ReplaceOnce(testing::ReadText(folder_.path() / "free.xml"), "  </worldbody>", "</body></worldbody>"));
  Write("free.urdf", ReplaceOnce(kUrdf, "<link name=\"stand\"/>",
                                 "<link name=\"stand\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" "
                                 "iyy=\"1\" izz=\"1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>"));
  Compare("free.urdf", "free.xml", 0);
}

// 100 MB hold the program's libraries and not the engine's stack.
TEST_F(CompareFiles, WantOfMemoryIsNoInvalidModel) {
  const std::string command =
      "ulimit -v 100000; exec '" + testing::ProgramPath() + "' consistency b.xml b.xml";
  const ProgramResult result = testing::RunProgram({"/bin/bash", "-c", command}, {folder_.path()});
  EXPECT_NE(result.exit_code, 2) << result.err;
  EXPECT_THAT(result.err, ::testing::Not(HasSubstr("not a valid")));
}

}  // namespace
}  // namespace dexcheck::testing::compare_files_test
