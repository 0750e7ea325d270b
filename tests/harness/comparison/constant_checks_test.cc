// Every kind of constant that the MJCF can have otherwise than the parameters is found and named.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <ostream>

#include "controller/model/parameter_reader.h"
#include "harness/comparison/engine_constants.h"
#include "harness/engine/engine.h"
#include "tests/common/files.h"
#include "tests/common/paths.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::static_gate_test {
namespace {

const std::string kParameters = SourcePath("/controller/parameters/");
const std::string kMjcf = SourcePath("/mjcf/");

/// One place changed in the shipped MJCF, and the finding that it must lead to.
struct Mutation {
  const char* name;
  const char* file;
  std::string from;
  std::string to;
  const char* check;
  const char* where;
};
void PrintTo(const Mutation& mutation, std::ostream* stream) { *stream << mutation.name; }

class StaticGateFiles : public ::testing::Test {
 protected:
  StaticGateFiles() {
    std::filesystem::copy(
        kMjcf, folder_.path(),
        std::filesystem::copy_options::recursive | std::filesystem::copy_options::overwrite_existing);
  }

  [[nodiscard]] ConstantChecks Run() const {
    const MjModelPtr engine = LoadMjcf(folder_.path() / "scene.xml");
    return CheckConstants(Adapter(model_, *engine, "scene.xml"));
  }

  TempFolder folder_;
  RobotModel model_ = ReadRobotModel(kParameters + "assistant_robot.toml");
};

class StaticGateTest : public StaticGateFiles, public ::testing::WithParamInterface<Mutation> {};

TEST_P(StaticGateTest, FindsAndNames) {
  const Mutation& mutation = GetParam();
  const std::filesystem::path file = folder_.path() / mutation.file;
  WriteText(file, ReplaceOnce(ReadText(file), mutation.from, mutation.to));
  const ConstantChecks result = Run();
  const auto finding = std::ranges::find_if(result.findings, [&](const ConstantFinding& one) {
    return one.check == mutation.check && one.where == mutation.where;
  });
  std::string found;
  for (const ConstantFinding& one : result.findings) found += one.check + ": " + one.where + "; ";
  ASSERT_NE(finding, result.findings.end()) << "found: " << found;
  EXPECT_NE(finding->model, finding->engine);
  for (const CheckRecord& record : result.records) {
    EXPECT_EQ(record.failed, found.find(record.name + ": ") != std::string::npos) << record.name;
  }
}

// A fingertip's body may have other spheres, before it: one that is only seen, one that touches elsewhere.
TEST_F(StaticGateFiles, TheFingertipIsTheSphereThatTouchesAtItsSite) {
  const std::string tip = R"(<geom name="rf1_tip_geom" class="tip"/>)";
  const std::string seen = R"(<geom name="seen" size="0.011" pos="0 0 -0.0185" mass="0" contype="0" )"
                           R"(conaffinity="0"/>)";
  const std::string knuckle = R"(<geom name="knuckle" size="0.008" mass="0" contype="2"/>)";
  const std::filesystem::path file = folder_.path() / "robot.xml";
  WriteText(file, ReplaceOnce(ReadText(file), tip, seen + knuckle + tip));
  const MjModelPtr engine = LoadMjcf(folder_.path() / "scene.xml");
  const Adapter adapter(model_, *engine, "scene.xml");
  const int frame = model_.FindFrame("rf1_tip");
  const int wanted = mj_name2id(engine.get(), mjOBJ_GEOM, "rf1_tip_geom");
  ASSERT_LT(mj_name2id(engine.get(), mjOBJ_GEOM, "knuckle"), wanted);
  EXPECT_EQ(adapter.RequireTipGeom(frame), wanted);
  for (const ConstantFinding& one : CheckConstants(adapter).findings)
    EXPECT_NE(one.check, "fingertip_radius");
}

const char* const kWheel = "joint wheel_right";
const char* const kElbow = "joint r_elbow on link r_upper_arm";
const char* const kFingertip = "frame rf3_tip on link rf3_phalanx_4";

INSTANTIATE_TEST_SUITE_P(
    Mjcf, StaticGateTest,
    ::testing::ValuesIn(std::vector<Mutation>{
        {"Spring", "robot.xml", R"(range="-0.1 2.5")", R"(range="-0.1 2.5" stiffness="1")", "joint_spring",
         kElbow},
        {"DryFriction", "robot.xml", R"(range="-0.1 2.5")", R"(range="-0.1 2.5" frictionloss="0.1")",
         "joint_dry_friction", kElbow},
        {"GravityTilted", "stage.xml", R"(gravity="0 0 -9.81")", R"(gravity="0.01 0 -9.81")",
         "gravity_vector", "robot"},
        {"WheelRadiusSmaller", "robot.xml", R"(<default class="tyre"> <geom size="0.1"/>)",
         R"(<default class="tyre"> <geom size="0.099"/>)", "wheel_radius", kWheel},
        {"AxleForward", "robot.xml", R"(<body name="wheel_right" pos="0 -0.20 0">)",
         R"(<body name="wheel_right" pos="0.01 -0.20 0">)", "axle_position", kWheel},
        {"AxleHigh", "robot.xml", R"(<body name="wheel_right" pos="0 -0.20 0">)",
         R"(<body name="wheel_right" pos="0 -0.20 0.01">)", "axle_position", kWheel},
        {"WheelAxis", "robot.xml", R"(<joint axis="0 1 0" limited="false")",
         R"(<joint axis="0 1 0.01" limited="false")", "wheel_axis", kWheel},
        {"WheelBackwards", "robot.xml", R"(<joint axis="0 1 0" limited="false")",
         R"(<joint axis="0 -1 0" limited="false")", "wheel_axis", kWheel},
        {"WheelSpring", "robot.xml", R"(damping="0.02" armature="0.004")",
         R"(damping="0.02" armature="0.004" stiffness="1")", "joint_spring", kWheel},
        {"WheelDryFriction", "robot.xml", R"(damping="0.02" armature="0.004")",
         R"(damping="0.02" armature="0.004" frictionloss="0.1")", "joint_dry_friction", kWheel},
        {"BaseDryFriction", "robot.xml", R"(<freejoint name="base"/>)",
         R"(<joint name="base" type="free" limited="false" frictionloss="0.1"/>)", "joint_dry_friction",
         "free joint of link platform"},
        {"FingertipPlace", "robot.xml", R"(<default class="tip"> <geom size="0.009" pos="0 0 -0.0185"/>)",
         R"(<default class="tip"> <geom size="0.008" pos="0 0 -0.0195"/>)", "fingertip_radius", kFingertip},
        {"PairFriction", "contacts.xml", R"(<default class="fingertip"> <pair condim="3" friction="0.8 0.8)",
         R"(<default class="fingertip"> <pair condim="3" friction="0.8 0.7)", "contact_friction", kFingertip},
        {"PairMissing", "contacts.xml",
         R"(<pair name="rf3_torus" class="fingertip" geom1="rf3_tip_geom" geom2="torus_geom"/>)", "",
         "contact_friction", kFingertip},
        {"ObjectCom", "torus.xml", R"(<inertial pos="0 0 0")", R"(<inertial pos="0 0 0.001")", "object_com",
         "object torus"},
        {"ObjectShape", "torus.xml", R"(user="0.035 0.011")", R"(user="0.035 0.012")", "object_shape",
         "object torus"},
        {"ObjectUnmarked", "torus.xml", R"(user="0.035 0.011")", "", "object_shape", "object torus"},
    }),
    [](const auto& info) { return info.param.name; });

void ExpectNoFindings(const RobotModel& model, const std::filesystem::path& mjcf) {
  const MjModelPtr engine = LoadMjcf(mjcf);
  const ConstantChecks result = CheckConstants(Adapter(model, *engine, mjcf));
  EXPECT_TRUE(result.findings.empty())
      << result.findings.front().check << " " << result.findings.front().where;
  EXPECT_GE(result.records.size(), 7U);
  for (const CheckRecord& record : result.records) {
    EXPECT_FALSE(record.failed) << record.name;
    EXPECT_GT(record.comparisons, 0) << record.name;
  }
}

TEST(ConstantComparison, RaisesNoFalseAlarm) {
  ExpectNoFindings(ReadRobotModel(kParameters + "assistant_robot.toml"), kMjcf + "scene.xml");
  ExpectNoFindings(ReadRobotModel(kParameters + "panda.toml"), kMjcf + "panda.xml");
}

// The larger ring agrees with what its scenario says of it, and not with the torus of the parameter file.
TEST(ConstantComparison, DistinguishesTheRingFromTheTorus) {
  const Scenario scenario = ReadShippedScenario("two-hands");
  const std::string robot = kParameters + "assistant_robot.toml";
  ExpectNoFindings(ParseRobotModel(ReadText(robot), robot, scenario.model_overrides), scenario.mjcf_file);

  const RobotModel torus = ReadRobotModel(robot);
  const MjModelPtr engine = LoadMjcf(scenario.mjcf_file);
  std::vector<std::string> found;
  for (const ConstantFinding& one : CheckConstants(Adapter(torus, *engine, "ring_scene.xml")).findings) {
    found.push_back(one.check);
  }
  EXPECT_THAT(found, ::testing::IsSupersetOf({"object_mass", "object_inertia", "object_shape"}));
}

}  // namespace
}  // namespace dexcheck::testing::static_gate_test
