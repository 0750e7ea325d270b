// URDFs are read into the model that they describe: against the engine's model of the same robot, written by
// another route, and by hand; whatever is wrong with one is a single line.

#include "harness/descriptions/urdf_reader.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "controller/common/errors.h"
#include "controller/model/parameter_reader.h"
#include "controller/model/rigid_body.h"
#include "harness/comparison/description_match.h"
#include "harness/descriptions/description_writer.h"
#include "harness/descriptions/read_description.h"
#include "harness/engine/engine.h"
#include "tests/common/files.h"
#include "tests/common/list_failures.h"
#include "tests/common/matchers.h"
#include "tests/common/matrix_near.h"
#include "tests/common/paths.h"
#include "tests/common/random_robot.h"
#include "tests/common/refused_text.h"
#include "tests/common/throws.h"
#include "tests/common/urdf_text.h"
#include "tests/harness/descriptions/panda_urdf.h"

namespace dexcheck::testing::urdf_reader_test {
namespace {

// A few products of rotations of size 1.
constexpr double kRounding = 1e-14;

/// Names of the checks that fail between a URDF and an engine's model.
std::string ListFailures(const std::string& urdf, const mjModel& engine, long samples = 20) {
  RobotDescription robot = ParseUrdf(urdf, "robot.urdf");
  CompleteFromEngine(engine, "robot.xml", &robot);
  return CompareWithEngine(robot, engine, samples);
}

TEST(Urdf, PandaAgreesWithTheMjcf) {
  const MjModelPtr engine = LoadMjcf(SourcePath("/mjcf/panda.xml"));
  EXPECT_EQ(ListFailures(MakePandaUrdf(), *engine, 200), "");
}

TEST(Urdf, RandomRobotsAgreeWithTheirMjcf) {
  std::mt19937 random(1700);
  for (int index = 0; index < 40; ++index) {
    RandomRobotOptions options;
    options.base = BaseType::kFixed;
    options.joints = 1 + index % 13;
    options.branching = 0.1 * (index % 6);
    RobotSpec spec = MakeRandomRobot(options, &random);
    for (Joint& joint : spec.joints) joint.armature = index % 2 == 0 ? 0.0 : joint.armature;
    const double dry_friction = 0.01 * index;
    const std::string urdf = WriteUrdf(&spec, &random, dry_friction);
    std::string mjcf = WriteMjcf(spec);
    for (size_t at = mjcf.find("armature="); at != std::string::npos; at = mjcf.find("armature=", at)) {
      const std::string loss = fmt::format(R"(frictionloss="{:.17g}" )", dry_friction);
      mjcf.insert(at, loss);
      at += loss.size() + 1;
    }
    const MjModelPtr engine = LoadMjcfText(mjcf, "text");
    EXPECT_EQ(ListFailures(urdf, *engine), "") << "robot " << index;
  }
}

/// One change of a right URDF, and a check that finds it.
struct Fault {
  std::string name;
  std::string original;
  std::string changed;
  std::string found_by;
};

class Faults : public ::testing::TestWithParam<Fault> {};

TEST_P(Faults, AreFound) {
  const MjModelPtr engine = LoadMjcf(SourcePath("/mjcf/panda.xml"));
  const std::string urdf = ReplaceFirst(MakePandaUrdf(), GetParam().original, GetParam().changed);
  EXPECT_THAT(ListFailures(urdf, *engine), HasSubstr(GetParam().found_by));
}

INSTANTIATE_TEST_SUITE_P(
    Urdf, Faults,
    ::testing::Values(Fault{"Mass", R"(value="3.228604")", R"(value="3.3")", "link_mass"},
                      Fault{"Com", "0.003875 0.002081", "0.003875 0.0021", "link_com"},
                      Fault{"Axis", R"(<axis xyz="0 0 1"/>)", R"(<axis xyz="0 0 -1"/>)", "joint_axis"},
                      Fault{"InertialRpy", R"(rpy="0 0 0"/><mass)", R"(rpy="0 0 0.001"/><mass)",
                            "link_inertia"},
                      Fault{"Damping", R"(damping="0.003")", R"(damping="0.004")", "joint_damping"},
                      Fault{"DryFriction", R"(friction="0")", R"(friction="0.2")", "joint_dry_friction"},
                      Fault{"Range", R"(lower="-1.7628")", R"(lower="-1.76")", "joint_range"},
                      Fault{"Flange", "0 0 0.107", "0 0 0.108", "frame_pose"}),
    CaseName());

// A coupling that both sides have is compared; one that only the MJCF has is a disagreement.
TEST(Urdf, CouplingsAreComparedWithTheMjcfs) {
  std::string mjcf = ReadText(SourcePath("/mjcf/panda.xml"));
  const std::string end = "</mujoco>";
  mjcf.replace(mjcf.rfind(end), end.size(),
               R"(<equality><joint name="tied" joint1="panda_joint3" joint2="panda_joint5" )"
               R"(polycoef="0.1 0.5 0 0 0"/></equality></mujoco>)");
  const MjModelPtr engine = LoadMjcfText(mjcf, "text");
  const std::string urdf = MakePandaUrdf();
  EXPECT_EQ(ListFailures(urdf, *engine), "equality_constraint ");
  const auto couple = [&](const std::string& mimic) {
    std::string coupled = urdf;
    const size_t joint = coupled.find(R"(<joint name="panda_joint3")");
    EXPECT_NE(joint, std::string::npos);
    return coupled.insert(coupled.find("<parent", joint), mimic);
  };
  EXPECT_EQ(ListFailures(couple(R"(<mimic joint="panda_joint5" multiplier="0.5" offset="0.1"/>)"), *engine),
            "");
  EXPECT_EQ(ListFailures(couple(R"(<mimic joint="panda_joint5" multiplier="0.6" offset="0.1"/>)"), *engine),
            "joint_coupling ");
}

// Two fingers with a coupled joint, a welded tip, odd names, and what URDFs leave out.
constexpr const char* kHand = R"(<?xml version="1.0"?>
<robot name="hand">
  <link name="palm"/>
  <link name="finger 1">
    <inertial><origin xyz="0 0 0.02" rpy="0 0 1.5707963267948966"/><mass value="0.1"/>
    <inertia ixx="2e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1.5e-5"/></inertial>
  </link>
  <link name="finger/2">
    <inertial><origin xyz="0 0.01 0"/><mass value="0.2"/>
    <inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial>
  </link>
  <link name="tip">
    <visual><geometry><mesh filename="package://hand/tip.stl"/></geometry></visual>
    <inertial><mass value="0.2"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial>
  </link>
  <link name="sensor"/>
  <joint name="knuckle" type="revolute"><origin xyz="0 0.1 0" rpy="0 0 1.5707963267948966"/>
    <parent link="palm"/><child link="finger 1"/><axis xyz="0 2 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/><dynamics damping="0.1" friction="0.3"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="palm"/><child link="finger/2"/><axis xyz="-1 0 0"/>
    <limit lower="0" upper="0.1" effort="1" velocity="1"/>
    <mimic joint="knuckle" multiplier="-0.05" offset="0.02"/>
  </joint>
  <joint name="weld" type="fixed"><origin xyz="0 0.03 0"/><parent link="finger/2"/><child link="tip"/></joint>
  <joint name="wheel" type="continuous"><parent link="tip"/><child link="sensor"/></joint>
</robot>
)";

TEST(Urdf, ReadsAHandByHand) {
  const RobotDescription hand = ParseUrdf(kHand, "hand.urdf");
  const RobotSpec& spec = hand.spec;
  EXPECT_EQ(spec.name, "hand");
  EXPECT_EQ(spec.base.link, "palm");
  ASSERT_EQ(spec.joints.size(), 3U);

  // The knuckle turns about y of a frame that is turned by 90 degrees about z: -x of the palm.
  const Joint& knuckle = spec.joints[0];
  EXPECT_TRUE(MatrixNear(knuckle.X_PB.linear().col(2), Vector3d(-1.0, 0.0, 0.0), kRounding));
  EXPECT_TRUE(MatrixNear(knuckle.X_PB.translation(), Vector3d(0.0, 0.1, 0.0), kRounding));
  const MassProperties finger =
      ExpressIn(knuckle.body, hand.joints[0].X_iL.inverse());  // in the link's own frame
  EXPECT_TRUE(MatrixNear(finger.com, Vector3d(0.0, 0.0, 0.02), kRounding));
  // Turned about z by 90 degrees, ixx and iyy change places.
  EXPECT_TRUE(
      MatrixNear(finger.inertia, Matrix3d(Vector3d(1e-5, 2e-5, 1.5e-5).asDiagonal()), 1e-5 * kRounding));
  EXPECT_EQ(knuckle.damping, 0.1);
  EXPECT_EQ(hand.spec.joints[0].dry_friction, 0.3);
  EXPECT_EQ(knuckle.lower, -1.0);
  EXPECT_FALSE(hand.spec.joints[0].coupling);

  // The finger carries the tip: 0.2 kg at 0.01 m and 0.2 kg at 0.03 m.
  const Joint& slide = spec.joints[1];
  EXPECT_EQ(slide.link, "finger/2");
  EXPECT_EQ(slide.type, JointType::kPrismatic);
  const MassProperties both = ExpressIn(slide.body, hand.joints[1].X_iL.inverse());
  EXPECT_NEAR(both.mass, 0.4, kRounding);
  EXPECT_TRUE(MatrixNear(both.com, Vector3d(0.0, 0.02, 0.0), kRounding));
  const double I_xx = 1e-5 + 0.4 * 0.01 * 0.01;
  EXPECT_TRUE(MatrixNear(both.inertia, Matrix3d(Vector3d(I_xx, 1e-5, I_xx).asDiagonal()), 1e-5 * kRounding));
  ASSERT_TRUE(hand.spec.joints[1].coupling);
  EXPECT_EQ(hand.spec.joints[1].coupling->leader, 0);
  EXPECT_EQ(hand.spec.joints[1].coupling->multiplier, -0.05);
  EXPECT_EQ(hand.spec.joints[1].coupling->offset, 0.02);
  EXPECT_FALSE(hand.joints[1].states_damping);
  EXPECT_FALSE(hand.joints[1].states_armature);

  // An axis that is not given is x; a continuous joint states no range.
  const Joint& wheel = spec.joints[2];
  EXPECT_EQ(wheel.parent, 1);
  EXPECT_TRUE(
      MatrixNear(hand.joints[1].X_iL.linear() * Vector3d::UnitX(), wheel.X_PB.linear().col(2), kRounding));
  EXPECT_FALSE(hand.joints[2].states_range);
  EXPECT_EQ(wheel.upper, kPi);

  ASSERT_EQ(spec.frames.size(), 1U);
  EXPECT_EQ(spec.frames[0].name, "tip");
  EXPECT_THAT(hand.notes, ElementsAre(StartsWith(R"(joint "knuckle": axis [0, 2, 0] is not a unit vector)"),
                                      "links without inertial, taken as massless: palm, sensor",
                                      "joints that move no mass: wheel"));

  // xi = T xi_free: the slide follows the knuckle.
  MatrixXd T(3, 2);
  T << 1.0, 0.0, -0.05, 0.0, 0.0, 1.0;
  EXPECT_EQ(CalcCouplingMap(RobotModel(hand.spec)), T);
}

TEST(Urdf, KeepsAnyNameInATable) {
  const RobotModel table =
      ParseRobotModel(WriteParameters(ParseUrdf(kHand, "hand.urdf"), "hand.urdf"), "hand.toml");
  EXPECT_EQ(table.joints()[0].link, "finger 1");
  EXPECT_EQ(table.joints()[1].link, "finger/2");
  EXPECT_EQ(table.joints()[2].parent, 1);
}

// Only the body that a part is welded to must be possible; published robots have many impossible parts.
TEST(Urdf, TakesPartsThatNoBodyCanBe) {
  const std::string point =
      R"(<mass value="0.2"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>)";
  const std::string text = ReplaceOnce(
      kHand, point, R"(<mass value="0"/><inertia ixx="1e-6" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>)");
  const RobotDescription hand = ParseUrdf(text, "hand.urdf");
  EXPECT_THAT(hand.notes,
              ::testing::Contains("impossible inertials, merged into the link that they are welded to: tip"));
  EXPECT_NEAR(hand.spec.joints[1].body.inertia.trace(), 3.1e-5, 1e-18);
}

// Colours are nothing that dynamics need, and other readers refuse two of one name.
TEST(Urdf, LeavesOutMaterialsThatAreNotUnique) {
  std::string text = kHand;
  const std::string material = R"(<material name="white"><color rgba="1 1 1 1"/></material>)";
  text.insert(text.find("</robot>"), material);
  const RobotDescription once = ParseUrdf(text, "hand.urdf");
  text.insert(text.find("</robot>"), material);
  RobotDescription twice = ParseUrdf(text, "hand.urdf");
  EXPECT_EQ(twice.notes.size(), once.notes.size() + 1);
  EXPECT_THAT(twice.notes, ::testing::Contains(HasSubstr("materials")));
  twice.notes = once.notes;
  EXPECT_EQ(WriteParameters(twice, "hand.urdf"), WriteParameters(once, "hand.urdf"));
}

// A file that is refused for an impossible body alone is still read by the audit.
TEST(Urdf, ARefusalOfABodyPointsToTheAudit) {
  const TempFolder folder;
  const auto read = [&](const std::string& original, const std::string& changed) -> std::string {
    WriteText(folder.path() / "hand.urdf", ReplaceFirst(kHand, original, changed));
    return MessageOf<InputError>([&] { return ReadDescription(folder.path() / "hand.urdf"); });
  };
  const std::string file = (folder.path() / "hand.urdf").string();
  const std::string impossible = read(R"(<mass value="0.1"/>)", R"(<mass value="-0.1"/>)");
  EXPECT_THAT(impossible, StartsWith(file + R"(:4: link "finger 1": inertial: mass must be)"));
  EXPECT_THAT(impossible, HasSubstr("(dexcheck audit " + file));
  EXPECT_THAT(read(R"(child link="tip")", R"(child link="tipp")"),
              ::testing::AllOf(HasSubstr("must be a link"), Not(HasSubstr("audit"))));
}

TEST(Urdf, FollowsAFollowerToItsLeader) {
  std::string text = kHand;
  text.insert(text.find("</robot>"), R"(<link name="last"/><joint name="last" type="continuous">
    <parent link="palm"/><child link="last"/><mimic joint="slide" multiplier="10" offset="1"/></joint>)");
  const RobotDescription hand = ParseUrdf(text, "hand.urdf");
  ASSERT_TRUE(hand.spec.joints[3].coupling);
  EXPECT_EQ(hand.spec.joints[3].coupling->leader, 0);
  EXPECT_DOUBLE_EQ(hand.spec.joints[3].coupling->multiplier, -0.5);
  EXPECT_DOUBLE_EQ(hand.spec.joints[3].coupling->offset, 1.2);
}

TEST(Urdf, LooksForMeshesWhereAFolderIsNamed) {
  const TempFolder folder;
  UrdfOptions options;
  options.packages.push_back(folder.path());
  EXPECT_THAT(ParseUrdf(kHand, "hand.urdf", options).notes,
              ::testing::Contains("meshes that are missing (dynamics need none): package://hand/tip.stl"));
  std::filesystem::create_directory(folder.path() / "hand");
  WriteText(folder.path() / "hand" / "tip.stl", "solid");
  EXPECT_EQ(ParseUrdf(kHand, "hand.urdf", options).notes.size(), 3U);
  options.packages = {folder.path() / "hand"};
  EXPECT_EQ(ParseUrdf(kHand, "hand.urdf", options).notes.size(), 3U);
}

std::string CatchProblem(const std::string& text) {
  return MessageOf<InputError>([&] { return ParseUrdf(text, "hand.urdf"); });
}

class BadUrdfs : public ::testing::TestWithParam<RefusedText> {};

TEST_P(BadUrdfs, AreRefusedInOneLine) {
  RefusedText refused = GetParam();
  refused.parts.push_back("hand.urdf:");
  EXPECT_TRUE(
      IsRefused(kHand, refused, [](const std::string& text) { return ParseUrdf(text, "hand.urdf"); }));
}

INSTANTIATE_TEST_SUITE_P(
    Urdf, BadUrdfs,
    ::testing::Values(
        OneEdit("BrokenXml", "</robot>", "</robo>", "is not XML, XML_ERROR_MISMATCHED_ELEMENT"),
        OneEdit("NoRobot", R"(<robot name="hand">)", R"(<sdf><robot name="hand">)", "is not XML"),
        OneEdit("Xacro", R"(<link name="palm"/>)", "<xacro:arm/>", "hand.urdf:3: is a template, got"),
        OneEdit("NoName", R"(<link name="palm"/>)", "<link/>", "hand.urdf:3: link: must have a name"),
        OneEdit("NameTwice", R"(<link name="sensor"/>)", R"(<link name="tip"/>)",
                R"(hand.urdf:16: link "tip": names must be unique, taken on line 12)"),
        OneEdit("JointTwice", R"(joint name="slide")", R"(joint name="knuckle")",
                R"(joint "knuckle": names must be unique)"),
        OneEdit("AxisTwice", R"(<axis xyz="0 2 0"/>)", R"(<axis xyz="0 2 0"/><axis xyz="0 0 1"/>)",
                R"(hand.urdf:18: joint "knuckle": axis: stated twice, first on line 18)"),
        OneEdit("InertialTwice", R"(<inertial><mass value="0.2"/>)",
                R"(<inertial/><inertial><mass value="0.2"/>)",
                R"(link "tip": inertial: stated twice, first on line)"),
        OneEdit("MassTwice", R"(<mass value="0.1"/>)", R"(<mass value="0.1"/><mass value="1"/>)",
                R"(link "finger 1": inertial: mass: stated twice, first on line)"),
        OneEdit("MissingLink", R"(child link="tip")", R"(child link="tipp")",
                R"(hand.urdf:26: joint "weld": child: must be a link (did you mean "tip"?), got "tipp")"),
        OneEdit("TwoParents", R"(child link="sensor")", R"(child link="tip")",
                R"(joint "wheel": child: must hang on one joint only, "tip" hangs on "weld" too)"),
        OneEdit("Cycle", R"(parent link="finger/2"/><child link="tip")",
                R"(parent link="sensor"/><child link="tip")",
                R"(links must not be cyclic, got "tip -> sensor -> tip")"),
        OneEdit("NoRoot", R"(parent link="finger/2"/><child link="tip")",
                R"(parent link="finger/2"/><child link="palm")", "links must not be cyclic"),
        OneEdit("TwoRoots", R"(<link name="palm"/>)", R"(<link name="palm"/><link name="other"/>)",
                R"(link "other": must hang on a joint, since "palm" is the root already)"),
        OneEdit("NoParent", R"(<parent link="tip"/>)", "",
                R"(joint "wheel": parent: missing, must name a link)"),
        OneEdit("Mass", R"(<mass value="0.1"/>)", R"(<mass value="%n%s"/>)",
                R"(hand.urdf:5: link "finger 1": mass: value: must be a number, got "%n%s")"),
        OneEdit("NoMass", R"(<mass value="0.1"/>)", "", R"(link "finger 1": mass: value: missing)"),
        OneEdit("NegativeMass", R"(<mass value="0.1"/>)", R"(<mass value="-0.1"/>)",
                R"(link "finger 1": inertial: mass must be finite and not negative, got -0.1)"),
        OneEdit("NoIxx", R"(ixx="2e-5" )", "", R"(link "finger 1": inertia: ixx: missing)"),
        OneEdit(
            "NegativeMoment", R"(ixx="2e-5")", R"(ixx="-2e-4")",
            R"(hand.urdf:4: link "finger 1": inertial: principal moments of inertia must not be negative)"),
        OneEdit("InertialOrigin", R"(xyz="0 0 0.02")", R"(xyz="0 0")",
                R"(hand.urdf:5: link "finger 1": origin: xyz: must be three numbers, got "0 0")"),
        OneEdit("InertialTurn", R"(rpy="0 0 1.5707963267948966"/><mass)", R"(rpy="0 0 1.6 rad"/><mass)",
                R"(hand.urdf:5: link "finger 1": origin: rpy: must be three numbers, got "0 0 1.6 rad")"),
        OneEdit("JointOrigin", R"(xyz="0 0.1 0")", R"(xyz="0 0.1")",
                R"(hand.urdf:17: joint "knuckle": origin: xyz: must be three numbers, got "0 0.1")"),
        OneEdit("Type", R"(type="continuous")", R"(type="hinge")",
                R"(joint "wheel": type: must be fixed, revolute, continuous or prismatic, got "hinge")"),
        OneEdit("NoLimit", R"(<limit lower="0" upper="0.1" effort="1" velocity="1"/>)", "",
                R"(hand.urdf:21: joint "slide": limit: missing)"),
        OneEdit("NoEffort", R"(effort="1" velocity="1"/><dynamics)", R"(velocity="1"/><dynamics)",
                R"(hand.urdf:19: joint "knuckle": limit: effort: missing)"),
        OneEdit("Version", R"(<robot name="hand">)", R"(<robot name="hand" version="2.0">)",
                R"(hand.urdf:2: robot: version: must be 1.0, got "2.0")"),
        OneEdit("Floating", R"(type="continuous")", R"(type="floating")",
                R"(joint "wheel": type: must be fixed, revolute, continuous or prismatic, got "floating")"),
        OneEdit("Axis", R"(xyz="0 2 0")", R"(xyz="0 0 0")", R"(joint "knuckle": axis: must not be zero)"),
        OneEdit("Limits", R"(lower="-1" upper="1")", R"(lower="1" upper="-1")",
                R"(joint "knuckle": limit: lower must not exceed upper -1, got 1)"),
        OneEdit("Damping", R"(damping="0.1")", R"(damping="-0.1")",
                R"(joint "knuckle": dynamics: damping must not be negative, got -0.1)"),
        OneEdit("Mimic", R"(mimic joint="knuckle")", R"(mimic joint="weld")",
                R"(joint "slide": mimic: must be a joint that moves, got "weld")"),
        OneEdit("MimicOfItself", R"(mimic joint="knuckle")", R"(mimic joint="slide")",
                R"(joint "slide": mimic: must not be cyclic, got "slide")")),
    CaseName());

TEST(Urdf, RefusesWhatIsTooLargeOrEmpty) {
  std::string many = R"(<robot name="many"><link name="0"/>)";
  for (int i = 1; i < 100000; ++i) {
    many += fmt::format(R"(<link name="{0}"/><joint name="{0}" type="fixed"><parent link="{1}"/><child )"
                        R"(link="{0}"/></joint>)",
                        i, i - 1);
  }
  EXPECT_THAT(CatchProblem(many + "</robot>"), HasSubstr("a robot must have at most 2000 links"));
  std::string deep = R"(<robot name="deep">)";
  for (int i = 0; i < 100000; ++i) deep += "<a>";
  EXPECT_THAT(CatchProblem(deep), HasSubstr("is not XML"));
  EXPECT_THAT(CatchProblem(""), HasSubstr("is not XML"));
  EXPECT_THAT(CatchProblem(R"(<robot name="none"/>)"), HasSubstr("must have links"));
  EXPECT_THAT(CatchProblem("<mujoco/>"), HasSubstr(R"(must have the root element <robot>, got "<mujoco>")"));
  EXPECT_THAT(CatchProblem(R"(<robot name="r"><link name="a"/></robot>)"),
              HasSubstr("no joint moves and the root is fixed (--floating lets it float), got 0 joints"));
  EXPECT_THAT(
      CatchProblem(R"(<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="continuous">)"
                   R"(<parent link="a"/><child link="b"/></joint></robot>)"),
      HasSubstr("no link has an inertial"));
}

}  // namespace
}  // namespace dexcheck::testing::urdf_reader_test
