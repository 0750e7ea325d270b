// Dry friction, joints that follow others, several joints of one body: in tables, URDFs, MJCFs and programs.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "controller/common/errors.h"
#include "controller/model/parameter_reader.h"
#include "harness/comparison/consistency.h"
#include "harness/descriptions/description_writer.h"
#include "harness/descriptions/mjcf_reader.h"
#include "harness/engine/engine.h"
#include "tests/common/evaluate_terms.h"
#include "tests/common/files.h"
#include "tests/common/list_failures.h"
#include "tests/common/matchers.h"
#include "tests/common/refused_text.h"
#include "tests/common/throws.h"

namespace dexcheck::testing::coupled_joints_test {
namespace {

// A gripper whose right finger follows the left one, which follows the wrist: q_right = -2 q_wrist - 0.3.
constexpr const char* kGripper = R"(name = "gripper"
gravity = [0, 0, -9.81]
[base]
type = "fixed"
link = "arm"
[[chain]]
parent = "arm"
rows = [{ joint = "wrist", link = "palm", xyz = [0, 0, 0.1], axis = "x" }]
[chain.joints]
wrist = { range = [-1, 1], damping = 0.1, armature = 0.01, dry_friction = 0.4 }
[chain.links]
palm = { mass = 1, com = [0.01, 0.02, 0.05], inertia = [0.002, 0.003, 0.004, 0, 0, 0] }
[template.finger]
rows = [{ joint = "joint", link = "link", xyz = [0, 0.03, 0.1], axis = [0, 1, 0] }]
[template.finger.links]
link = { mass = 0.2, com = [0, 0.01, 0.03], inertia = [0.0002, 0.0003, 0.0001, 0, 0, 0] }
[[chain]]
parent = "palm"
template = "finger"
prefix = "right_"
[chain.joints]
joint = { range = [-1, 1], damping = 0, armature = 0, mimic = { joint = "left_joint", multiplier = -1, offset = 0.1 } }
[[chain]]
parent = "palm"
template = "finger"
prefix = "left_"
[chain.joints]
joint = { range = [-1, 1], damping = 0, armature = 0, mimic = { joint = "wrist", multiplier = 2, offset = 0.4 } }
)";

RobotDescription ReadGripper(const std::string& text) { return ReadTable(text, "gripper.toml"); }

TEST(CoupledJoints, TablesSayThem) {
  const RobotDescription table = ReadGripper(kGripper);
  const std::vector<Joint>& joints = table.spec.joints;
  ASSERT_EQ(joints.size(), 3U);
  EXPECT_EQ(joints[0].dry_friction, 0.4);
  EXPECT_EQ(joints[1].dry_friction, 0.0);
  EXPECT_FALSE(joints[0].coupling);
  ASSERT_TRUE(joints[1].coupling && joints[2].coupling);
  EXPECT_EQ(joints[1].coupling->leader, 0);
  EXPECT_EQ(joints[1].coupling->multiplier, -2.0);
  EXPECT_DOUBLE_EQ(joints[1].coupling->offset, -0.3);
  EXPECT_EQ(joints[2].coupling->multiplier, 2.0);
  EXPECT_EQ(CalcCouplingMap(RobotModel(table.spec)), Vector3d(1.0, -2.0, 2.0));

  // Written and read again they are the same.
  const RobotDescription again = ReadGripper(WriteParameters(table, "gripper.toml"));
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(again.spec.joints[i].dry_friction, joints[i].dry_friction);
    ASSERT_EQ(again.spec.joints[i].coupling.has_value(), joints[i].coupling.has_value());
    if (!joints[i].coupling) continue;
    EXPECT_EQ(again.spec.joints[i].coupling->leader, joints[i].coupling->leader);
    EXPECT_EQ(again.spec.joints[i].coupling->multiplier, joints[i].coupling->multiplier);
    EXPECT_EQ(again.spec.joints[i].coupling->offset, joints[i].coupling->offset);
  }
}

TEST(CoupledJoints, FaultsInTablesAreNamed) {
  const auto expect = [](const std::string& original, const std::string& changed,
                         const std::string& message) {
    const RefusedText refused = {"", {{original, changed}}, {"gripper.toml:", message}};
    EXPECT_TRUE(IsRefused(kGripper, refused, ReadGripper));
  };
  expect(R"(joint = "wrist", multiplier = 2)", R"(joint = "wrists", multiplier = 2)",
         R"(must be a joint (did you mean "wrist"?), got "wrists")");
  expect(R"(joint = "wrist", multiplier = 2)", R"(joint = "right_joint", multiplier = 2)",
         "must not follow itself");
  expect(R"(joint = "wrist", multiplier = 2)", R"(joint = "left_joint", multiplier = 2)",
         "must not follow itself");
  expect("multiplier = 2", "factor = 2", "factor");
  expect("dry_friction = 0.4", "dry_friction = -0.4", "dry_friction");
}

// The gripper in MJCF: a0 + a1 q of equality/joint, the right finger's by the left one.
constexpr const char* kGripperMjcf = R"(<mujoco><compiler angle="radian"/><worldbody><body name="arm">
  <body name="palm" pos="0 0 0.1">
    <joint name="wrist" axis="1 0 0" damping="0.1" armature="0.01" frictionloss="0.4" limited="true" range="-1 1"/>
    <inertial pos="0.01 0.02 0.05" mass="1" diaginertia="0.002 0.003 0.004"/>
    <body name="right_link" pos="0 0.03 0.1"><joint name="right_joint" axis="0 1 0" limited="true" range="-1 1"/>
      <inertial pos="0 0.01 0.03" mass="0.2" diaginertia="0.0002 0.0003 0.0001"/></body>
    <body name="left_link" pos="0 0.03 0.1"><joint name="left_joint" axis="0 1 0" limited="true" range="-1 1"/>
      <inertial pos="0 0.01 0.03" mass="0.2" diaginertia="0.0002 0.0003 0.0001"/></body>
  </body></body></worldbody>
  <equality><joint joint1="left_joint" joint2="wrist" polycoef="0.4 2 0 0 0"/>
    <joint joint1="right_joint" joint2="left_joint" polycoef="0.1 -1 0 0 0"/></equality></mujoco>)";

TEST(CoupledJoints, TablesAgreeWithTheMjcf) {
  const MjModelPtr engine = LoadMjcfText(kGripperMjcf, "gripper.xml");
  EXPECT_EQ(CompareWithEngine(ReadGripper(kGripper), *engine), "");
  EXPECT_EQ(CompareWithEngine(ReadMjcfDescription(*engine, "gripper.xml"), *engine), "");
  EXPECT_EQ(
      CompareWithEngine(ReadGripper(ReplaceOnce(kGripper, "multiplier = 2", "multiplier = 2.01")), *engine),
      "joint_coupling ");
  EXPECT_EQ(CompareWithEngine(ReadGripper(ReplaceOnce(kGripper, "offset = 0.1", "offset = 0.2")), *engine),
            "joint_coupling ");
  EXPECT_EQ(CompareWithEngine(ReadGripper(ReplaceOnce(kGripper, "dry_friction = 0.4", "dry_friction = 0.3")),
                              *engine),
            "joint_dry_friction ");
  EXPECT_EQ(CompareWithEngine(ReadGripper(ReplaceOnce(kGripper, ", dry_friction = 0.4", "")), *engine),
            "joint_dry_friction ");
  std::vector<std::string> notes;
  const std::string uncoupled =
      ReplaceOnce(kGripper, R"(, mimic = { joint = "wrist", multiplier = 2, offset = 0.4 })", "");
  EXPECT_THAT(CompareWithEngine(ReadGripper(uncoupled), *engine, 20, &notes), HasSubstr("joint_coupling"));
  EXPECT_THAT(notes, ::testing::Contains(HasSubstr("only the MJCF couples left_joint")));
}

/// A program that knows the free joint alone, with the equations of the whole gripper on its constraint:
/// energies and their derivatives by a route of its own, T(xi) = 1/2 m(q) v^2.
class ReducedGripper : public LayoutProvider {
 public:
  explicit ReducedGripper(const RobotDescription& robot)
      : LayoutProvider(ProgramLayout(robot, nlohmann::json{{"joints", {"wrist"}}}, "the program")),
        whole_(robot.spec, "gripper") {}
  [[nodiscard]] const std::string& name() const override { return whole_.name(); }
  TermResults Evaluate(long, const VectorXd& q, const VectorXd& xi) override {
    const double wrist = layout().WritePositions(q)[0];
    const double rate = layout().WriteVelocities(q, xi)[0];
    constexpr double kStep = 1e-5;
    const auto mass = [&](double at) { return 2.0 * *Whole(at, 1.0).kinetic; };
    const double m = mass(wrist);
    const double slope = (mass(wrist + kStep) - mass(wrist - kStep)) / (2.0 * kStep);
    const double weight =
        (*Whole(wrist + kStep, 0.0).potential - *Whole(wrist - kStep, 0.0).potential) / (2.0 * kStep);
    TermResults terms;
    terms.M = MatrixXd::Constant(1, 1, m);
    terms.coriolis = VectorXd::Constant(1, 0.5 * slope * rate * rate);  // d/dt (m v) - dT/dq at constant v
    terms.gravity = VectorXd::Constant(1, weight);
    return terms;
  }

 private:
  TermResults Whole(double wrist, double rate) {
    return EvaluateTerms(&whole_, Vector3d(wrist, -2.0 * wrist - 0.3, 2.0 * wrist + 0.4),
                         Vector3d(rate, -2.0 * rate, 2.0 * rate));
  }
  AnalyticProvider whole_;
};

TEST(CoupledJoints, ArePutOnTheirConstraintWhenAProgramHasOnlyFreeOnes) {
  const RobotDescription robot = ReadGripper(kGripper);
  const RobotModel model(robot.spec);
  AnalyticProvider reference(model, "gripper.toml");
  ReducedGripper program(robot);
  EXPECT_TRUE(program.is_reduced());
  ConsistencyOptions options;
  options.samples = 10;
  const ConsistencyResult result = CompareProviders(
      model, &reference, &program, FeedRandomStates(model, options), [](long) { return true; });
  EXPECT_EQ(result.samples, 10);
  const std::vector<CheckRecord>& terms = result.terms;
  ASSERT_EQ(terms.size(), 3U);
  constexpr double kDifference = 1e-7;  // of central differences
  for (const CheckRecord& record : terms) {
    EXPECT_EQ(record.comparisons, 10) << record.name;
    EXPECT_LT(record.worst, kDifference) << record.name;
    EXPECT_GT(std::abs(record.engine_value), 1e-6) << record.name;
  }
  EXPECT_LT(terms[0].worst, 1e-14);  // M needs no difference
}

// Two hinges and a slide of one body are three joints with links between them that have no mass.
TEST(SeveralJointsOfABody, AgreeWithAChainOfMasslessLinks) {
  const MjModelPtr engine = LoadMjcfText(R"(<mujoco><compiler angle="radian"/><worldbody>
    <body name="ground"><body name="shoulder" pos="0.1 0.2 0.3" euler="0.1 0.2 0.3">
      <joint name="x" axis="1 0 0" pos="0 0 0.05" limited="true" range="-1 1"/>
      <joint name="y" axis="0 1 0" limited="true" range="-1 1"/>
      <joint name="out" type="slide" axis="0 0 1" limited="true" range="0 0.2"/>
      <inertial pos="0.02 0 0.1" mass="2" diaginertia="0.02 0.03 0.01"/>
      <body name="hand" pos="0 0 0.3"><joint name="twist" axis="0 0 1" limited="true" range="-2 2"/>
        <inertial pos="0.01 0.02 0" mass="0.5" diaginertia="0.001 0.002 0.0015"/></body>
    </body></body></worldbody></mujoco>)",
                                         "shoulder.xml");
  const RobotDescription mjcf = ReadMjcfDescription(*engine, "shoulder.xml");
  ASSERT_EQ(mjcf.spec.joints.size(), 4U);
  EXPECT_EQ(mjcf.spec.joints[0].link, "shoulder:x");
  EXPECT_EQ(CompareWithEngine(mjcf, *engine), "");
  EXPECT_EQ(CompareWithEngine(ReadGripper(WriteParameters(mjcf, "shoulder.xml")), *engine), "");

  RobotDescription wrong = mjcf;
  std::swap(wrong.spec.joints[0].X_PB, wrong.spec.joints[1].X_PB);
  EXPECT_THAT(CompareWithEngine(wrong, *engine), HasSubstr("joint_axis"));
  wrong = mjcf;
  wrong.spec.joints[0].body = {0.1, Vector3d::Zero(), Matrix3d::Identity() * 1e-4};
  EXPECT_THAT(CompareWithEngine(wrong, *engine), HasSubstr("link_mass"));
  wrong = mjcf;
  std::swap(wrong.spec.joints[0].name, wrong.spec.joints[1].name);
  EXPECT_TRUE(Throws<InputError>([&] { CompareWithEngine(wrong, *engine); }, R"(joint "y")"));
}

}  // namespace
}  // namespace dexcheck::testing::coupled_joints_test
