// One description alone: each oddity is found where it is, a sound robot has none.

#include "harness/descriptions/audit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "harness/descriptions/mjcf_reader.h"
#include "harness/descriptions/read_description.h"
#include "harness/descriptions/urdf_reader.h"
#include "harness/engine/engine.h"
#include "tests/common/files.h"
#include "tests/common/legged_robots.h"
#include "tests/common/matchers.h"
#include "tests/common/paths.h"
#include "tests/common/refused_text.h"
#include "tests/harness/descriptions/panda_urdf.h"

namespace dexcheck::testing::audit_test {
namespace {

// A torso with two arms, each link in a box that it fills.
constexpr const char* kArms = R"(<robot name="arms">
  <link name="torso"/>
  <link name="left_arm">
    <collision><origin xyz="0 0.2 0"/><geometry><box size="0.1 0.4 0.08"/></geometry></collision>
    <inertial><origin xyz="0.01 0.2 0"/><mass value="2"/>
    <inertia ixx="0.028" ixy="0.001" ixz="0.0002" iyy="0.0035" iyz="0.0004" izz="0.029"/></inertial>
  </link>
  <link name="right_arm">
    <collision><origin xyz="0 -0.2 0"/><geometry><box size="0.1 0.4 0.08"/></geometry></collision>
    <inertial><origin xyz="0.01 -0.2 0"/><mass value="2"/>
    <inertia ixx="0.028" ixy="-0.001" ixz="0.0002" iyy="0.0035" iyz="-0.0004" izz="0.029"/></inertial>
  </link>
  <joint name="left" type="revolute"><origin xyz="0 0.1 0"/><parent link="torso"/><child link="left_arm"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="2" effort="1" velocity="1"/></joint>
  <joint name="right" type="revolute"><origin xyz="0 -0.1 0"/><parent link="torso"/><child link="right_arm"/>
    <axis xyz="1 0 0"/><limit lower="-2" upper="1" effort="1" velocity="1"/></joint>
</robot>
)";

AuditResult Audit(const std::string& urdf) {
  UrdfOptions options;
  options.keep_impossible = true;
  return AuditRobot(ParseUrdf(urdf, "arms.urdf", options));
}

std::string Describe(const AuditResult& result) {
  std::string text;
  for (const AuditFinding& finding : result.findings) {
    text += std::string(NameOf(finding.level)) + " " + finding.check + ": " + finding.where + " " +
            finding.text + "\n";
  }
  return text;
}

// About its origin, at one end of its box, a link has more than all mass at the ends has about the centre.
TEST(Audit, AnInertiaAboutTheOriginIsNamed) {
  const std::string about_origin =
      ReplaceOnce(ReplaceOnce(kArms, "ixx=\"0.028\" ixy=\"0.001\"", "ixx=\"0.108\" ixy=\"0.001\""),
                  "iyz=\"0.0004\" izz=\"0.029\"", "iyz=\"0.0004\" izz=\"0.1092\"");
  EXPECT_THAT(
      Describe(Audit(about_origin)),
      ::testing::HasSubstr("link left_arm has a moment of inertia of 0.108 kg m^2, more than its mass "
                           "can have within its geometry, 0.08"));
  EXPECT_THAT(Describe(Audit(about_origin)), ::testing::HasSubstr("as if it were about the link's origin"));
}

TEST(Audit, DegreesOfAFixedJointAreNamed) {
  const std::string camera =
      "<link name=\"camera\"/><joint name=\"c\" type=\"fixed\"><origin rpy=\"0 ANGLE 0\"/>"
      "<parent link=\"left_arm\"/><child link=\"camera\"/></joint></robot>";
  const auto audit = [&](const char* angle) {
    return Describe(Audit(ReplaceOnce(kArms, "</robot>", ReplaceOnce(camera, "ANGLE", angle))));
  };
  EXPECT_THAT(audit("90"), ::testing::HasSubstr("offset: link camera is turned by 90 rad"));
  EXPECT_EQ(audit("1.5708"), "");
}

TEST(Audit, SoundRobotsAreGood) {
  const AuditResult result = Audit(kArms);
  EXPECT_TRUE(result.IsGood()) << Describe(result);
  EXPECT_GT(result.condition, 1.0);
  EXPECT_LT(result.condition, 1.2);
  const AuditResult panda = Audit(MakePandaUrdf());
  EXPECT_TRUE(panda.IsGood()) << Describe(panda);
  const AuditResult table =
      AuditRobot(ReadDescription(SourcePath("/controller/parameters/assistant_robot.toml")));
  EXPECT_TRUE(table.IsGood()) << Describe(table);
  for (const auto& links : {ListQuadruped(), ListHumanoid()}) {
    const AuditResult urdf = Audit(WriteLeggedUrdf("legged", links));
    EXPECT_TRUE(urdf.IsGood()) << Describe(urdf);
    const MjModelPtr engine = LoadMjcfText(WriteLeggedMjcf("legged", links), "legged.xml");
    const AuditResult mjcf = AuditRobot(ReadMjcfDescription(*engine, "legged.xml"));
    EXPECT_TRUE(mjcf.IsGood()) << Describe(mjcf);
    EXPECT_TRUE(std::isfinite(mjcf.condition));
  }
}

/// A change of the sound robot and what is said of it.
struct Suspicion {
  std::string name;
  std::string original;
  std::string changed;
  std::string finding;
};

class Suspicions : public ::testing::TestWithParam<Suspicion> {};

TEST_P(Suspicions, AreFound) {
  const AuditResult result = Audit(ReplaceFirst(kArms, GetParam().original, GetParam().changed));
  EXPECT_FALSE(result.IsGood());
  EXPECT_THAT(Describe(result), HasSubstr(GetParam().finding));
}

INSTANTIATE_TEST_SUITE_P(
    Audit, Suspicions,
    ::testing::Values(
        Suspicion{"Triangle", R"(ixx="0.028")", R"(ixx="0.28")",
                  "impossible inertia: link left_arm has principal moments [0.0034"},
        Suspicion{"Negative", R"(iyy="0.0035")", R"(iyy="-0.0035")", "one of them negative"},
        Suspicion{"NegativeMass", R"(<mass value="2"/>)", R"(<mass value="-2"/>)",
                  "impossible mass: link left_arm has a negative mass, -2 kg"},
        Suspicion{"NoMass", R"(<mass value="2"/>)", R"(<mass value="0"/>)",
                  "impossible inertia: link left_arm has inertia"},
        Suspicion{"GramsForKilograms", R"(<mass value="2"/>)", R"(<mass value="2000"/>)",
                  "suspicious density: link left_arm has 2000 kg in a geometry of 0.0032 m^3"},
        Suspicion{"Light", R"(<mass value="2"/>)", R"(<mass value="0.002"/>)",
                  "suspicious density: link left_arm"},
        Suspicion{
            "ComOutside", R"(xyz="0.01 0.2 0")", R"(xyz="0.01 2 0")",
            "suspicious com: link left_arm has its centre of mass [0.01, 2, 0] m outside of its geometry"},
        Suspicion{"TooMuchInertia",
                  R"(ixx="0.028" ixy="0.001" ixz="0.0002" iyy="0.0035" iyz="0.0004" izz="0.029")",
                  R"(ixx="28" ixy="1" ixz="0.2" iyy="3.5" iyz="0.4" izz="29")",
                  "more than its mass can have within its geometry"},
        Suspicion{"GramMillimetres",
                  R"(ixx="0.028" ixy="0.001" ixz="0.0002" iyy="0.0035" iyz="0.0004" izz="0.029")",
                  R"(ixx="2.8e-8" ixy="1e-9" ixz="2e-10" iyy="3.5e-9" iyz="4e-10" izz="2.9e-8")",
                  "which is small for its 2 kg"},
        Suspicion{"MirroredMass", R"(<mass value="2"/>)", R"(<mass value="2.2"/>)",
                  "suspicious mirror: link right_arm has 2 kg, the other side 2.2 kg (against left_arm)"},
        Suspicion{"MirroredSigns", R"(ixy="-0.001")", R"(ixy="0.001")",
                  "suspicious mirror: link right_arm has products of inertia [0.001, 0.0002, -0.0004] kg m^2 "
                  "with signs"},
        Suspicion{"MirroredPlace", R"(xyz="0.01 -0.2 0")", R"(xyz="0.01 -0.17 0")",
                  "suspicious mirror: link right_arm has its centre of mass at [0.01, -0.17, 0] m"},
        Suspicion{"Degrees", R"(lower="-1" upper="2")", R"(lower="-90" upper="120")",
                  "suspicious range: joint left range [-90, 120] rad: as if it were in degrees"},
        Suspicion{"AngleInDegrees", R"(<origin xyz="0 0.1 0"/>)", R"(<origin xyz="0 0.1 0" rpy="0 90 0"/>)",
                  "suspicious offset: joint left is turned by 90 rad: as if angles were in degrees"},
        Suspicion{"Damping", R"(<axis xyz="1 0 0"/>)", R"(<axis xyz="1 0 0"/><dynamics damping="1e6"/>)",
                  "suspicious damping: joint left has a damping of 1e+06: nothing would move it"},
        Suspicion{"NoRange", R"(lower="-1" upper="2")", R"(lower="0" upper="0")", "the joint cannot move"},
        Suspicion{"Axis", R"(<axis xyz="1 0 0"/>)", R"(<axis xyz="1 1 0"/>)",
                  "suspicious axis: joint left axis of length 1.414"},
        Suspicion{"NameByCase", R"(joint name="right")", R"(joint name="Left")",
                  R"(suspicious name: joint Left its name is that of "left" but for case and punctuation)"}),
    CaseName());

// Each finding names its effect on M: a point mass on the axis leaves it singular.
TEST(Audit, SaysWhatItDoesToTheMassMatrix) {
  const std::string point = R"(<robot name="point"><link name="base"/>
  <link name="rotor"><inertial><origin xyz="0 0 0.1"/><mass value="1"/>
    <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>
  <link name="arm"><inertial><origin xyz="0.1 0 0"/><mass value="1"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
  <joint name="lift" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/></joint>
  <joint name="spin" type="continuous"><parent link="arm"/><child link="rotor"/><axis xyz="0 0 1"/></joint>
  </robot>)";
  const AuditResult result = Audit(point);
  EXPECT_TRUE(std::isinf(result.condition));
  EXPECT_THAT(Describe(result),
              HasSubstr("suspicious inertia: link rotor has 1 kg without inertia: a point mass"));
  EXPECT_THAT(Describe(result),
              HasSubstr("suspicious load: joint spin turns 1 kg without inertia about its axis, the end"));
  for (const AuditFinding& finding : result.findings) {
    ASSERT_TRUE(finding.condition_without) << finding.text;
    EXPECT_LT(*finding.condition_without, 1e3);
  }
}

// Impossible inertias have an M too: that of the file, which is not positive then.
TEST(Audit, CountsImpossibleInertiaAsTheFileHasIt) {
  const std::string text = ReplaceFirst(kArms, R"(iyz="0.0004" izz="0.029")", R"(iyz="0.0004" izz="2.9")");
  EXPECT_LT(Audit(text).condition, 1.2);  // about x, izz does not count
  EXPECT_TRUE(std::isinf(Audit(ReplaceFirst(text, R"(ixx="0.028")", R"(ixx="-28")")).condition));
}

}  // namespace
}  // namespace dexcheck::testing::audit_test
