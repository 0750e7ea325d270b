// Files for releases of MuJoCo after 2.2.2.

#include <gmock/gmock.h>

#include "controller/common/errors.h"
#include "harness/engine/engine.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/mujoco_release.h"
#include "tests/common/files.h"
#include "tests/common/matchers.h"
#include "tests/common/paths.h"
#include "tests/common/throws.h"

namespace dexcheck::testing::newer_mjcf_test {
namespace {

/// A pendulum with these words added at the places that their names say.
struct Words {
  std::string compiler, option, flag, root, joint, geom, body, in_body, actuator, tendon, sensor;
};

std::string WriteMjcf(const Words& words) {
  return "<mujoco>\n<compiler angle=\"radian\" autolimits=\"true\" " + words.compiler + "/>\n<option " +
         words.option + "><flag " + words.flag + "/></option>\n" + words.root +
         "<worldbody>\n<body name=\"arm\" " + words.body +
         ">\n<joint name=\"swing\" axis=\"0 1 0\" range=\"-1 1\" damping=\"0.1\" " + words.joint +
         "/>\n<geom type=\"capsule\" size=\"0.02 0.2\" pos=\"0 0 0.2\" " + words.geom +
         "/>\n<site name=\"tip\"/>" + words.in_body +
         "\n</body>\n</worldbody>\n<tendon><fixed name=\"pull\" " + words.tendon +
         "><joint joint=\"swing\" coef=\"1\"/></fixed></tendon>\n<actuator><position joint=\"swing\" " +
         words.actuator + "/></actuator>\n<sensor><jointpos joint=\"swing\" " + words.sensor +
         "/></sensor>\n</mujoco>\n";
}

const std::string kPlain = WriteMjcf({});

struct Copy {
  std::string text;
  std::vector<MjcfChange> changes;
};

Copy Downgrade(const std::string& text, const std::string& source) {
  MjcfFile mjcf(text, source);
  LeaveOutNewerWords(&mjcf);
  StateNewDefaults(&mjcf);
  return {mjcf.Print(), mjcf.changes()};
}

/// Inertia about the joint, bias, and passive force at one state.
std::vector<double> CalcTerms(const std::string& text) {
  const MjModelPtr model = LoadMjcfText(text, "test");
  const MjDataPtr data = MakeData(*model);
  data->qpos[0] = 0.3;
  data->qvel[0] = 0.7;
  mj_forward(model.get(), data.get());
  return {*GetMassEntries(*data), data->qfrc_bias[0], data->qfrc_passive[0]};
}

/// Words of later releases are new to 2.2.2 alone.
#define NEEDS_2_2_2() \
  if (mjVERSION_HEADER != 222) GTEST_SKIP() << "needs MuJoCo 2.2.2, this is " << mj_versionString()

const Words kLeftOut[] = {
    {.joint = R"(actuatorfrcrange="-5 5")"},
    {.joint = R"(actuatorgravcomp="true")"},
    {.joint = R"(stiffness="0 0 0")"},
    {.option = R"(integrator="implicitfast")"},
    {.option = R"(ls_iterations="20" ccd_iterations="30")"},
    {.flag = R"(eulerdamp="disable" nativeccd="enable")"},
    {.flag = R"(damper="enable")"},
    {.compiler = R"(saveinertial="true" alignfree="false")"},
    {.root = "<size memory=\"1M\"/>\n"},
    {.root = "<visual><global bvactive=\"false\"/></visual>\n"},
    {.root = "<default><camera resolution=\"64 48\"/></default>\n"},
    {.geom = R"(surfacevel="1 0 0")"},
    {.body = R"(gravcomp="0")"},
    {.in_body = R"(<light intensity="2"/>)"},
    {.in_body = R"(<body name="b" sleep="never"/>)"},
    {.actuator = R"(kv="3" dampratio="1" inheritrange="0")"},
    {.actuator = R"(armature="0.0")"},
    {.tendon = R"(armature="0" actuatorfrcrange="-1 1")"},
    {.sensor = R"(delay="0.1" nsample="3")"},
    {.root = "<sensor><e_kinetic/></sensor>\n"},
    {.root = "<sensor><contact geom1=\"a\"/><plugin/></sensor><extension><plugin/></extension>\n"}};

TEST(NewerMjcf, ThePendulumStaysWhereNewWordsAreLeftOut) {
  NEEDS_2_2_2();
  for (const Words& words : kLeftOut) {
    const std::string newer = WriteMjcf(words);
    SCOPED_TRACE(newer);
    EXPECT_EQ(CalcTerms(newer), CalcTerms(kPlain));
    const Copy copy = Downgrade(newer, "newer");
    EXPECT_FALSE(copy.changes.empty());
    const std::vector<double> terms = CalcTerms(copy.text);
    EXPECT_EQ(terms, CalcTerms(kPlain));
    for (const double term : terms) EXPECT_NE(term, 0.0);
    // The copy is for 2.2.2 already.
    EXPECT_TRUE(Downgrade(copy.text, "copy").changes.empty());
  }
}

/// Words that act on the dynamics are refused in one line, with place, release and remedy.
struct Refused {
  Words words;
  std::string message;
};
const Refused kRefused[] = {
    {{.body = R"(gravcomp="1")"},
     "newer.xml:5: <body gravcomp>: acts on the dynamics, since MuJoCo 2.3.1: it "
     "holds a part of the weight"},
    {{.tendon = R"(armature="0.1")"}, "<fixed armature>: acts on the dynamics, since MuJoCo 3.3.1"},
    {{.actuator = R"(armature="0.1")"}, "<position armature>: acts on the dynamics, since MuJoCo 3.7.0"},
    {{.flag = R"(damper="disable")"}, "<flag damper>: acts on the dynamics, since MuJoCo 3.3.6"},
    {{.joint = R"(stiffness="0 1")"}, "<joint stiffness>: acts on the dynamics: 2.2.2 has the first"},
    {{.in_body = R"(<frame pos="0 0 1"/>)"},
     "<frame>: acts on the dynamics, since MuJoCo 3.1.0: load the file"},
    {{.in_body = "<plugin/>"}, "<plugin>: acts on the dynamics, since MuJoCo 2.3.0"},
    {{.in_body = R"(<replicate count="2"/>)"}, "<replicate>: acts on the dynamics"},
    {{.joint = R"(springiness="1")"}, "<joint springiness>: is neither in 2.2.2 nor known to be newer"},
    {{.in_body = "<wing/>"}, "<wing>: is neither in 2.2.2 nor known to be newer"}};

TEST(NewerMjcf, WordsThatActOnTheDynamicsAreNamed) {
  NEEDS_2_2_2();
  for (const auto& [words, message] : kRefused)
    EXPECT_TRUE(Throws<InputError>([text = WriteMjcf(words)] { Downgrade(text, "newer.xml"); }, message));
}

TEST(NewerMjcf, TheNewDefaultIsStated) {
  const Copy copy = Downgrade("<mujoco><worldbody/></mujoco>", "newer");
  EXPECT_THAT(copy.text, HasSubstr(R"(<compiler autolimits="true"/>)"));
  EXPECT_THAT(copy.changes, Contains(Field(&MjcfChange::word, "<compiler autolimits>")));
  EXPECT_TRUE(Downgrade(kPlain, "plain").changes.empty());
}

TEST(NewerMjcf, AssetsHaveTheirFolders) {
  const Copy copy = Downgrade(R"(<mujoco><compiler assetdir="a" meshdir="m"/></mujoco>)", "newer");
  EXPECT_THAT(copy.text, HasSubstr(R"(meshdir="m" texturedir="a")"));
}

/// The shipped robots and scenes have nothing that the engine does not know.
TEST(NewerMjcf, ShippedFilesNeedNoCopy) {
  NEEDS_2_2_2();
  for (const std::string name : {"panda.xml", "robot.xml", "scene.xml", "contacts.xml"}) {
    const std::string path = SourcePath("/mjcf/" + name);
    for (const MjcfChange& change : Downgrade(ReadText(path), path).changes) {
      EXPECT_EQ(change.word, "<compiler autolimits>") << name;
    }
  }
}

TEST(NewerMjcf, WhatIsNoMjcfIsNamed) {
  NEEDS_2_2_2();
  EXPECT_TRUE(Throws<InputError>([] { LoadMjcfText(WriteMjcf({.in_body = "<frame/>"}), "f"); },
                                 "f:8: <frame>: acts on the dynamics, since MuJoCo 3.1.0"));
  EXPECT_TRUE(Throws<InputError>([] { Downgrade("<mujoco>", "f"); }, "f:1: is not XML"));
  EXPECT_TRUE(Throws<InputError>([] { Downgrade("<model/>", "f"); }, "f: must be an MJCF"));
}

/// A range limits, as in later releases; 2.2.2 requires "limited".
TEST(NewerMjcf, ARangeLimits) {
  for (const auto& [words, limited] : {std::pair("", 1), std::pair(R"(limited="false")", 0)}) {
    const MjModelPtr model =
        LoadMjcfText(R"(<mujoco><worldbody><body><joint range="-20 30" )" + std::string(words) +
                         R"(/><geom size="1"/></body></worldbody></mujoco>)",
                     "robot");
    EXPECT_EQ(model->jnt_limited[0], limited) << words;
  }
}

// Words that only 2.2.2 has are read by later releases, with the same effect.
TEST(OlderMjcf, IsReadByLaterReleases) {
  const std::string words =
      WriteMjcf({.compiler = R"(convexhull="true" exactmeshinertia="false")",
                 .option = R"(collision="predefined" mpr_iterations="60" mpr_tolerance="1e-7" apirate="50")",
                 .flag = R"(passive="disable" sensornoise="enable")"});
  const MjModelPtr model = LoadMjcfText(words, "older");
  EXPECT_EQ(GetColliderIterations(model->opt), 60);
  EXPECT_EQ(GetColliderTolerance(model->opt), 1e-7);
  EXPECT_FALSE(CollidesByType(*model));
  EXPECT_EQ(CalcTerms(words).back(), 0.0) << "passive forces are off";
  EXPECT_NE(CalcTerms(kPlain).back(), 0.0);
  if (mjVERSION_HEADER == 222) return;
  const Copy copy = Downgrade(words, "older");
  EXPECT_THAT(copy.text, AllOf(HasSubstr(R"(spring="disable")"), HasSubstr(R"(damper="disable")")));
  EXPECT_THAT(copy.changes, Contains(AllOf(Field(&MjcfChange::word, "<option mpr_iterations>"),
                                           Field(&MjcfChange::what, "written as ccd_iterations"))));
}

// Geoms touch by pairs alone, by their masks alone, or by both.
TEST(OlderMjcf, SaysWhichGeomsTouch) {
  for (const auto& [value, contacts] :
       {std::pair("all", 2), std::pair("predefined", 1), std::pair("dynamic", 1)}) {
    const MjModelPtr model =
        LoadMjcfText("<mujoco><option collision=\"" + std::string(value) +
                         R"("/><worldbody><geom name="floor" type="plane" size="1 1 1"/>)"
                         R"(<body><freejoint/><geom size="0.1"/></body>)"
                         R"(<body pos="1 0 0"><freejoint/><geom name="ball" contype="0" )"
                         R"(conaffinity="0" size="0.1"/></body>)"
                         R"(</worldbody><contact><pair geom1="floor" geom2="ball"/></contact></mujoco>)",
                     "older");
    const MjDataPtr data = MakeData(*model);
    mj_forward(model.get(), data.get());
    EXPECT_EQ(data->ncon, contacts) << value;
  }
}

// A frame that is nearly its body's, as two roundings of half a turn leave it, is not taken for it.
TEST(Frames, AreWhereTheFileHasThem) {
  constexpr double kTurn = 2e-8;  // rad
  const MjModelPtr model =
      LoadMjcfText(R"(<mujoco><worldbody><body><joint/><geom size="1" pos="1e-8 0 0"/>)"
                   R"(<site name="tool" quat="1 1e-8 0 0"/></body></worldbody></mujoco>)",
                   "robot");
  const MjDataPtr data = MakeData(*model);
  mj_kinematics(model.get(), data.get());
  EXPECT_NEAR(data->site_xmat[7], kTurn, 1e-16);
  EXPECT_NEAR(data->geom_xpos[0], 1e-8, 1e-16);
  EXPECT_NEAR(data->xipos[3], 1e-8, 1e-16);
}

/// The compiled model, byte by byte.
std::string Save(const mjModel& model) {
  std::string bytes(static_cast<size_t>(mj_sizeModel(&model)), '\0');
  mj_saveModel(&model, nullptr, bytes.data(), static_cast<int>(bytes.size()));
  return bytes;
}

// One document with what it includes is given to the compiler, instead of the files.
TEST(JoinedDocument, IsCompiledToTheModelOfTheFiles) {
  NEEDS_2_2_2();
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(SourcePath("/mjcf"))) {
    if (entry.path().extension() != ".xml") continue;
    char message[1000] = "";
    const MjModelPtr own(mj_loadXML(entry.path().c_str(), nullptr, message, sizeof(message)));
    if (!own) continue;  // a part for include
    EXPECT_EQ(Save(*LoadMjcf(entry.path())), Save(*own)) << entry.path();
    ++files;
  }
  EXPECT_GE(files, 5);
}

}  // namespace
}  // namespace dexcheck::testing::newer_mjcf_test
