// One case each of what is no number of a link: settings of a compiler, frames, rows of tables, mountings,
// gravity, ball joints, servos, springs, couplings.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>

#include "controller/common/errors.h"
#include "harness/corrections/corrections.h"
#include "harness/corrections/read_printed.h"
#include "tests/common/files.h"
#include "tests/common/paths.h"
#include "tests/common/throws.h"

namespace dexcheck::testing::correction_cases_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

DescriptionFile Read(const std::string& name, const std::string& text) { return {name, text, {}}; }

FileCorrections FindCorrections(const DescriptionFile& a, const DescriptionFile& b) {
  return dexcheck::FindCorrections(ReadPrintedRobot(a, &b), ReadPrintedRobot(b, &a));
}

std::string Replace(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::vector<std::string> ListIds(const FileCorrections& found) {
  std::vector<std::string> ids;
  for (const CorrectionItem& item : found.items) ids.push_back(item.id);
  return ids;
}

/// One arm, in both kinds of file.
const std::string kUrdf =
    "<robot name='arm'><link name='base'/><link name='upper'><inertial><origin xyz='0.1 0.02 0.03'/><mass "
    "value='2.13'/><inertia ixx='0.0104' iyy='0.0211' izz='0.0303' ixy='0.0011' ixz='0.0005' "
    "iyz='-0.0007'/></inertial></link><link name='lower'><inertial><origin xyz='0.08 -0.01 0.02'/><mass "
    "value='0.313'/><inertia ixx='0.00104' iyy='0.00231' izz='0.00283' ixy='0' ixz='0' "
    "iyz='0'/></inertial></link><link name='tip'/><joint name='q1' type='revolute'><parent "
    "link='base'/><child link='upper'/><origin xyz='0 0 0.3'/><axis xyz='0 0 1'/><limit lower='-1.5' "
    "upper='1.7' effort='10' velocity='1'/></joint><joint name='q2' type='revolute'><parent "
    "link='upper'/><child link='lower'/><origin xyz='0.4 0 0.01' rpy='0.3 -0.2 0.5'/><axis xyz='0 1 "
    "0'/><limit lower='-1.1' upper='1.2' effort='10' velocity='1'/></joint><joint name='tool' "
    "type='fixed'><parent link='lower'/><child link='tip'/><origin xyz='0.2 0.01 0' rpy='0 0 "
    "0.4'/></joint></robot>";
const std::string kMjcf =
    "<mujoco><compiler angle='radian' eulerseq='XYZ'/><worldbody><body name='base'><body name='upper' "
    "pos='0 0 0.3'><joint name='q1' axis='0 0 1' limited='true' range='-1.5 1.7'/><inertial pos='0.1 0.02 "
    "0.03' mass='2.13' fullinertia='0.0104 0.0211 0.0303 0.0011 0.0005 -0.0007'/><body name='lower' pos='0.4 "
    "0 0.01' euler='0.3 -0.2 0.5'><joint name='q2' axis='0 1 0' limited='true' range='-1.1 1.2'/><inertial "
    "pos='0.08 -0.01 0.02' mass='0.313' diaginertia='0.00104 0.00231 0.00283'/><site name='tip' pos='0.2 "
    "0.01 "
    "0' euler='0 0 0.4'/></body></body></body></worldbody></mujoco>";

FileCorrections Compare(const std::string& mjcf) {
  return FindCorrections(Read("arm.urdf", kUrdf), Read("arm.xml", mjcf));
}

TEST(CorrectionCases, TheTwoFilesAgree) { EXPECT_TRUE(Compare(kMjcf).agrees); }

// The text of both files says the same: the setting is the cause, with the text's number and the engine's.
TEST(CorrectionCases, ASettingOfTheCompilerIsNamed) {
  FileCorrections found = Compare(Replace(kMjcf, "angle=", "boundmass='0.5' angle="));
  ASSERT_THAT(ListIds(found), ElementsAre("body.compiled"));
  EXPECT_TRUE(found.items[0].in_second);
  EXPECT_THAT(DescribeItem(found.items[0]), AllOf(HasSubstr("lower"), HasSubstr("boundmass"),
                                                  HasSubstr("0.313 in the text, 0.5 in the engine")));
  EXPECT_EQ(found.items[0].explained, 1.0);
  const std::string thin = Replace(kMjcf, "0.00104 0.00231 0.00283", "0.00104 0.00131 0.00283");
  const DescriptionFile urdf = Read("arm.urdf", Replace(kUrdf, "iyy='0.00231'", "iyy='0.00131'"));
  EXPECT_TRUE(FindCorrections(urdf, Read("arm.xml", Replace(thin, "0.00283", "0.00231"))).items.size() == 1);
  found = FindCorrections(urdf, Read("arm.xml", Replace(thin, "angle=", "balanceinertia='true' angle=")));
  ASSERT_THAT(ListIds(found), ElementsAre("body.compiled"));
  EXPECT_THAT(DescribeItem(found.items[0]), HasSubstr("balanceinertia"));
}

TEST(CorrectionCases, AFrameOnALinkIsCompared) {
  const FileCorrections found = Compare(Replace(kMjcf, "euler='0 0 0.4'", "euler='0 0 0.9'"));
  ASSERT_EQ(found.items.size(), 1U);
  EXPECT_EQ(found.items[0].fault.of, SiteKind::kRotation);
  EXPECT_THAT(found.items[0].places, ElementsAre("joint tool"));
  // Both MJCFs have it as a frame.
  const FileCorrections frames = FindCorrections(
      Read("a.xml", Replace(kMjcf, "euler='0 0 0.4'", "euler='0 0 0.9'")), Read("b.xml", kMjcf));
  ASSERT_EQ(frames.items.size(), 1U);
  EXPECT_THAT(frames.items[0].places, ElementsAre("frame tip"));
}

TEST(CorrectionCases, AReductionOfATransmissionIsCompared) {
  const auto write = [](const char* reduction) {
    return Replace(kUrdf, "</robot>",
                   std::string("<transmission name='t'><joint name='q2'/><actuator name='m'>") +
                       "<mechanicalReduction>" + reduction +
                       "</mechanicalReduction></actuator></transmission>"
                       "</robot>");
  };
  const FileCorrections found = FindCorrections(Read("a.urdf", write("50")), Read("b.urdf", write("100")));
  EXPECT_THAT(ListIds(found), ElementsAre("number.gear"));
  // The gear of an MJCF is another thing.
  EXPECT_TRUE(FindCorrections(Read("a.urdf", write("50")), Read("b.xml", kMjcf)).agrees);
}

TEST(CorrectionCases, AMountingIsNamed) {
  const FileCorrections found =
      Compare(Replace(kMjcf, "<body name='base'>", "<body name='base' euler='3.14159265 0 0'>"));
  ASSERT_EQ(found.items.size(), 1U);
  EXPECT_THAT(found.items[0].places, ElementsAre("link base"));
  EXPECT_EQ(found.items[0].fault.of, SiteKind::kRotation);
}

TEST(CorrectionCases, GravityIsNamed) {
  const auto compare = [](const std::string& gravity) {
    const std::string option = "<option gravity='" + gravity + "'/><worldbody>";
    return ListIds(
        FindCorrections(Read("a.xml", Replace(kMjcf, "<worldbody>", option)), Read("b.xml", kMjcf)));
  };
  EXPECT_THAT(compare("0 0 9.81"), ElementsAre("gravity.sign"));
  EXPECT_THAT(compare("0 0 0"), ElementsAre("gravity.missing"));
  EXPECT_THAT(compare("0 0 -9810"), ElementsAre("gravity.mm"));
  EXPECT_THAT(compare("0 -9.81 0"), ElementsAre("gravity.axis"));
  EXPECT_THAT(compare("0 0 -9.7"), ElementsAre("gravity.value"));
  EXPECT_TRUE(compare("0 0 -9.81").empty());
}

TEST(CorrectionCases, SpringsServosAndConstraintsAreNamed) {
  EXPECT_THAT(ListIds(Compare(Replace(kMjcf, "axis='0 1 0'", "axis='0 1 0' stiffness='3.1'"))),
              ElementsAre("stiffness.missing"));
  const std::string servo = "<actuator><motor joint='q2'/><position joint='q2' kp='50'/></actuator></mujoco>";
  FileCorrections found = Compare(Replace(kMjcf, "</mujoco>", servo));
  ASSERT_THAT(ListIds(found), ElementsAre("constraint.missing"));
  EXPECT_THAT(found.items[0].values[0], HasSubstr("servo beside the motor of joint q2 (kp 50"));
  // A servo alone is what drives the joint.
  EXPECT_TRUE(Compare(Replace(kMjcf, "</mujoco>", Replace(servo, "<motor joint='q2'/>", ""))).agrees);
  const std::string weld =
      "<equality><connect body1='lower' body2='base' anchor='0 0 0'/></equality></mujoco>";
  found = Compare(Replace(kMjcf, "</mujoco>", weld));
  ASSERT_THAT(ListIds(found), ElementsAre("constraint.missing"));
  EXPECT_THAT(found.items[0].values[0], HasSubstr("connect lower base"));
}

TEST(CorrectionCases, ABallJointIsCompared) {
  const std::string ball =
      Replace(kMjcf, "axis='0 1 0' limited='true' range='-1.1 1.2'", "type='ball' damping='0.4'");
  const DescriptionFile right = Read("right.xml", ball);
  const auto compare = [&](const std::string& from, const std::string& to) {
    return ListIds(FindCorrections(Read("wrong.xml", Replace(ball, from, to)), right));
  };
  EXPECT_THAT(compare("damping='0.4'", "damping='0.5'"), ElementsAre("number.damping"));
  EXPECT_THAT(compare("damping='0.4'", "damping='0.4' pos='0 0 0.02'"), ElementsAre("number.axis_point"));
  EXPECT_THAT(compare("mass='0.313'", "mass='313'"), ElementsAre("mass.g"));
}

TEST(CorrectionCases, ABaseThatFloatsIsNotWelded) {
  const std::string floats =
      Replace(kMjcf, "<body name='base'>",
              "<body name='base'><freejoint/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>");
  const std::string welded = Replace(floats, "<freejoint/>", "");
  const FileCorrections found = FindCorrections(Read("a.xml", floats), Read("b.xml", welded));
  ASSERT_THAT(ListIds(found), ElementsAre("number.type"));
}

// A limit that one file alone states, where it states others.
TEST(CorrectionCases, OneSidedRangesDoNotAgree) {
  EXPECT_THAT(ListIds(Compare(Replace(kMjcf, "limited='true' range='-1.1 1.2'", ""))),
              ElementsAre("range.unneeded"));
  const DescriptionFile half = Read("half.urdf", Replace(kUrdf, "lower='-1.1' upper='1.2'", "upper='1.2'"));
  EXPECT_THAT(ListIds(FindCorrections(half, Read("arm.xml", kMjcf))), ElementsAre("number.range"));
}

// A number that is wrong twice over: what one correction leaves is looked at again.
FileCorrections CompareUrdfs(const std::string& first, const std::string& second) {
  return FindCorrections(Read("a.urdf", first), Read("b.urdf", second));
}

// Products that one file prints as 0 are exact: a factor that shrinks these puts nothing else right.
TEST(CorrectionCases, AnExactZeroHidesNoOtherEntry) {
  const std::string entries =
      "ixx='0.0104' iyy='0.0211' izz='0.0303' ixy='0.0011' ixz='0.0005' iyz='-0.0007'";
  const FileCorrections found =
      CompareUrdfs(Replace(kUrdf, entries,
                           "ixx='0.02409102262' iyy='0.02376976455' izz='0.02195988478' ixy='0.00012787556' "
                           "ixz='0.00114870039' iyz='0.00078086899'"),
                   Replace(kUrdf, entries, "ixx='0.0231' iyy='0.0231' izz='0.0231' ixy='0' ixz='0' iyz='0'"));
  EXPECT_THAT(ListIds(found), ElementsAre("number.inertia"));
}

TEST(CorrectionCases, OnlyAnAxisThatIsNotStatedIsMissing) {
  const std::string axis = "<axis xyz='0 0 1'/>", turned = "<axis xyz='1 0.1 0'/>";
  const std::string stated = Replace(kUrdf, axis, "<axis xyz='1 0 0'/>");
  EXPECT_THAT(ListIds(CompareUrdfs(stated, Replace(kUrdf, axis, turned))), ElementsAre("number.axis"));
  const FileCorrections missing = CompareUrdfs(kUrdf, Replace(kUrdf, axis, ""));
  EXPECT_THAT(ListIds(missing), ElementsAre("axis.missing"));
  EXPECT_TRUE(missing.items[0].in_second);
  EXPECT_THAT(ListIds(CompareUrdfs(Replace(kUrdf, axis, ""), kUrdf)), ElementsAre("axis.missing"));
}

// It does not act on a base that stands still, and is a number of both files all the same.
TEST(CorrectionCases, AnInertialOfTheBaseThatOneUrdfLacksIsNamed) {
  const std::string with = Replace(kUrdf, "<link name='base'/>",
                                   "<link name='base'><inertial><mass value='2.9'/><inertia ixx='0.01' "
                                   "iyy='0.01' izz='0.02' ixy='0' ixz='0' iyz='0'/></inertial></link>");
  EXPECT_THAT(ListIds(CompareUrdfs(kUrdf, with)), ElementsAre("body.missing"));
  EXPECT_THAT(ListIds(CompareUrdfs(with, kUrdf)), ElementsAre("body.missing"));
}

TEST(CorrectionCases, TwoFaultsOfOneWeldedBodyAreBothNamed) {
  const std::string fused = Replace(kUrdf, "<link name='tip'/>",
                                    "<link name='tip'><inertial><origin xyz='0.03 0.05 0.11'/><mass "
                                    "value='0.713'/><inertia ixx='0.00113' iyy='0.00171' izz='0.00192' "
                                    "ixy='0.0001' ixz='0.0002' iyz='-0.0001'/></inertial></link>");
  const PrintedRobot right = ReadPrintedRobot(Read("right.urdf", fused));
  // The other file has one body instead of the two.
  const std::string mjcf = Replace(
      Replace(kMjcf, "<site name='tip' pos='0.2 0.01 0' euler='0 0 0.4'/>",
              "<body name='tip' pos='0.2 0.01 0' euler='0 0 0.4'><inertial pos='0.03 0.05 0.11' mass='0.713' "
              "fullinertia='0.00113 0.00171 0.00192 0.0001 0.0002 -0.0001'/></body>"),
      "body name='tip'", "body name='other'");
  EXPECT_TRUE(FindCorrections(right, ReadPrintedRobot(Read("arm.xml", mjcf))).agrees);
  std::string wrong = Replace(fused, "value='0.313'", "value='0.513'");
  wrong = Replace(wrong, "xyz='0.03 0.05 0.11'", "xyz='0.03 -0.05 0.11'");
  const FileCorrections found = FindCorrections(Read("wrong.urdf", wrong), Read("arm.xml", mjcf));
  const std::vector<std::string> ids = ListIds(found);
  EXPECT_THAT(ids, ::testing::UnorderedElementsAre("number.mass", "com.sign_y"));
}

// Tables of the Panda that were read by another convention.
class Rows : public ::testing::Test {
 protected:
  Rows()
      : right_(ReadPrintedRobot(DescriptionFile(SourcePath("/controller/parameters/panda.toml")))),
        mjcf_(ReadPrintedRobot(DescriptionFile(SourcePath("/mjcf/panda.xml")))) {}

  template <typename Change>
  [[nodiscard]] std::vector<std::string> Find(const Change& change) const {
    PrintedRobot wrong = right_;
    for (int i = 0; i < wrong.size(); ++i) {
      if (right_.link(i).origin.form == RotationForm::kMdh) change(i, &wrong);
    }
    return ListIds(FindCorrections(wrong, mjcf_));
  }

  PrintedRobot right_, mjcf_;
};

TEST_F(Rows, AgreeAsTheyAre) { EXPECT_TRUE(FindCorrections(right_, mjcf_).agrees); }

TEST_F(Rows, ThatAreClassicAreNamed) {
  const auto next = [&](int i) {
    for (const int child : right_.link(i).children) {
      if (right_.link(child).origin.form == RotationForm::kMdh) return right_.link(child).origin;
    }
    return PrintedOrigin{};
  };
  EXPECT_THAT(Find([&](int i, PrintedRobot* robot) {
                const PrintedOrigin row = next(i);
                PrintedLink& link = robot->link(i);
                link.origin.r[0] = row.r[0];
                link.origin.t[0] = row.t[0];
                Pose X = Pose::Identity();
                X.linear() = TurnAbout(0, row.r[0]);
                X.translation().x() = row.t[0];
                const Pose back = X.inverse();
                if (link.inertial) {
                  const Matrix3d R = back.linear() * link.inertial->origin.CalcRotation();
                  link.inertial->origin.t = back * link.inertial->origin.t;
                  link.inertial->origin.SetRotation(R);
                }
                for (const int child : link.children) {
                  PrintedOrigin& frame = robot->link(child).origin;
                  if (frame.form == RotationForm::kMdh) continue;
                  frame.t = back * frame.t;
                  frame.SetRotation(back.linear() * frame.CalcRotation());
                }
              }),
              ElementsAre("table.classic"));
}

// The file's word is not the rows'.
TEST_F(Rows, ThatTheFileCallsClassicAreNamed) {
  const std::string classic = Replace(ReadText(SourcePath("/controller/parameters/panda.toml")),
                                      "prefix = \"panda_\"", "prefix = \"panda_\"\nconvention = \"classic\"");
  EXPECT_THAT(ListIds(FindCorrections(ReadPrintedRobot(Read("classic.toml", classic)), mjcf_)),
              ElementsAre("table.modified"));
}

TEST_F(Rows, WithAnAngleOfTheOtherSignAreNamed) {
  for (const char* const joint : {"panda_joint4", "panda_joint5"}) {
    PrintedRobot wrong = right_;
    std::ranges::find_if(wrong.links, [&](const PrintedLink& link) {
      return link.joint.name == joint;
    })->origin.r[0] *= -1.0;
    const FileCorrections found = FindCorrections(wrong, mjcf_);
    ASSERT_THAT(ListIds(found), ElementsAre("place.sign_alpha"));
    EXPECT_TRUE(found.items[0].rivals.empty());
  }
}

TEST_F(Rows, ThatAreShiftedAreNamed) {
  EXPECT_THAT(Find([&](int i, PrintedRobot* robot) {
                const PrintedOrigin& above = right_.link(right_.link(i).parent).origin;
                const bool is_row = above.form == RotationForm::kMdh;
                robot->link(i).origin.r[0] = is_row ? above.r[0] : 0.0;
                robot->link(i).origin.t[0] = is_row ? above.t[0] : 0.0;
              }),
              ::testing::Contains("table.shifted_down"));
}

TEST_F(Rows, InDegreesOrMillimetresAreNamed) {
  const auto ids = Find([](int i, PrintedRobot* robot) { robot->link(i).origin.r *= 180.0 / kPi; });
  EXPECT_THAT(ids, ElementsAre("rotation.degrees"));
  EXPECT_EQ(Find([](int i, PrintedRobot* robot) { robot->link(i).origin.r[0] *= -1.0; }).size(), 1U);
}

TEST(Lengths, OfAWholeFileInAnotherUnitAreOneCause) {
  const PrintedRobot right = ReadPrintedRobot(DescriptionFile(SourcePath("/mjcf/robot.xml")));
  PrintedRobot wrong = right;
  for (PrintedLink& link : wrong.links) {
    link.origin.t *= 1e3;
    link.origin.half_t *= 1e3;
    link.joint.anchor *= 1e3;
    if (!link.inertial) continue;
    link.inertial->origin.t *= 1e3;
    link.inertial->origin.half_t *= 1e3;
  }
  EXPECT_THAT(ListIds(FindCorrections(wrong, right)), ElementsAre("lengths.mm"));
  EXPECT_THAT(ListIds(FindCorrections(right, wrong)), ElementsAre("lengths.per_1000"));
}

// The fault is in the second file: the first is right, and no patch makes it wrong.
TEST(FaultsOfTheSecondFile, AreNamedThereWithoutAPatch) {
  const std::string folder = SourcePath("/harness/descriptions/examples/field_cases/");
  const DescriptionFile arm(folder + "arm.urdf");
  const auto expect = [&](const std::string& name, const std::string& id, size_t places) {
    const FileCorrections found = FindCorrections(arm, DescriptionFile(folder + name));
    ASSERT_THAT(ListIds(found), ElementsAre(id)) << name;
    EXPECT_TRUE(found.items[0].in_second) << name;
    EXPECT_EQ(found.items[0].places.size(), places) << name;
    EXPECT_TRUE(found.items[0].patches.empty()) << name;
  };
  expect("rpy_lost.xml", "inertia.no_axes", 1);
  expect("about_origin.urdf", "inertia.about_origin", 2);
  expect("inertials_lost.xml", "body.missing", 3);
}

TEST(MjcfInMemory, IsRefusedForTheEnginesReason) {
  const char* const text =
      "<mujoco><worldbody><body name='b'><joint name='q'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 "
      "9'/></body></worldbody></mujoco>";
  EXPECT_TRUE(Throws<InputError>([&] { return Read("memory.xml", text).format(); }, "inertia must satisfy"));
}

}  // namespace
}  // namespace dexcheck::testing::correction_cases_test
