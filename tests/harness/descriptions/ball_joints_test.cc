// Robots with ball joints: the analytic model has the terms of the same robot on hinges, tables, MJCFs and
// the engine agree to rounding, and what differs is found.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "controller/common/errors.h"
#include "controller/dynamics/model_terms.h"
#include "controller/model/parameter_reader.h"
#include "controller/model/rigid_body.h"
#include "harness/comparison/consistency.h"
#include "harness/comparison/description_match.h"
#include "harness/comparison/file_causes.h"
#include "harness/corrections/read_printed.h"
#include "harness/descriptions/audit.h"
#include "harness/descriptions/description_writer.h"
#include "harness/descriptions/mjcf_reader.h"
#include "harness/descriptions/program_layout.h"
#include "harness/engine/engine.h"
#include "tests/common/files.h"
#include "tests/common/list_failures.h"
#include "tests/common/matchers.h"
#include "tests/common/matrix_near.h"
#include "tests/common/random_robot.h"
#include "tests/common/throws.h"

namespace dexcheck::testing::ball_joints_test {
namespace {

ConsistencyOptions Few() {
  ConsistencyOptions options;
  options.samples = 10;
  return options;
}

ConsistencyResult CompareWithEngine(const RobotModel& model, const mjModel& engine) {
  return CheckConsistency(Adapter(model, engine, "robot.xml"), Few(), [](long) { return true; });
}

RobotSpec MakeRobot(BaseType base, std::mt19937* random) {
  RandomRobotOptions options;
  options.base = base;
  options.joints = 8;
  options.ball = 0.5;
  RobotSpec spec = MakeRandomRobot(options, random);
  const auto is_ball = [](const Joint& joint) { return joint.type == JointType::kBall; };
  EXPECT_GE(std::ranges::count_if(spec.joints, is_ball), 2);
  return spec;
}

TEST(BallJoints, RandomRobotsAgree) {
  std::mt19937 random(17);
  for (const BaseType base : {BaseType::kFixed, BaseType::kFloating, BaseType::kPlanar}) {
    for (int index = 0; index < 2; ++index) {
      const RobotSpec spec = MakeRobot(base, &random);
      const RobotModel model(spec);
      EXPECT_GE(model.num_dofs(), model.num_joints() + 4);
      EXPECT_EQ(2 * (model.num_positions() - model.num_base_positions() - model.num_joints()),
                3 * (model.num_dofs() - model.num_joints()));
      const MjModelPtr engine = LoadMjcfText(WriteMjcf(spec), "text");
      EXPECT_EQ(ListFailures(CompareWithEngine(model, *engine)), "");
      if (base == BaseType::kPlanar) continue;  // an MJCF's description has none
      RobotDescription mjcf = ReadMjcfDescription(*engine, "robot.xml");
      EXPECT_EQ(ListFailures(CompareWithEngine(RobotModel(mjcf.spec), *engine)), "");
      // Angles of a table are rounded twice: when they are written, and when they are read.
      constexpr double kWritten = 1e-13;
      RobotDescription table = ReadTable(WriteParameters(mjcf, "robot.xml"));
      CompleteEachOther(&table, &mjcf);
      const ConsistencyResult result = CompareDescriptions(table, mjcf, Few());
      EXPECT_GE(result.terms.size(), 12U);
      for (const CheckRecord& record : result.terms) EXPECT_LT(record.worst, kWritten) << record.name;
    }
  }
}

/// Turns about z, y, x in the place of each ball, the first two of links without mass: its angular velocity
/// along its own axes is E times their rates, as for the Euler angles of a floating base.
struct OnHinges {
  RobotSpec spec;
  VectorXd q;
  MatrixXd T, T_dot;  // rates of the hinges = T xi
};

OnHinges PutOnHinges(const RobotModel& balls, const VectorXd& xi, VectorXd* q, std::mt19937* random) {
  OnHinges hinges;
  hinges.spec = balls.spec();
  hinges.spec.joints.clear();
  const int n = balls.num_dofs();
  hinges.q = VectorXd::Zero(n);
  hinges.T = MatrixXd::Identity(n, n);
  hinges.T_dot = MatrixXd::Zero(n, n);
  std::uniform_real_distribution<double> angle(-1.2, 1.2);
  const Vector3d axes[] = {Vector3d::UnitZ(), Vector3d::UnitY(), Vector3d::UnitX()};
  Pose X_turned = Pose::Identity();  // a ball's frame i in that of its last hinge
  X_turned.linear() = MakeRotationFromZ(Vector3d::UnitX()).transpose();
  const auto is_ball = [&](int joint) { return joint >= 0 && balls.joint(joint).type == JointType::kBall; };
  const auto last_of = [&](int joint) {
    return joint < 0 ? -1 : balls.dof(joint) + (is_ball(joint) ? 2 : 0);
  };
  for (int i = 0; i < balls.num_joints(); ++i) {
    Joint joint = balls.joint(i);
    if (is_ball(joint.parent)) joint.X_PB = X_turned * joint.X_PB;
    joint.parent = last_of(joint.parent);
    const int first = balls.dof(i);
    if (!is_ball(i)) {
      hinges.spec.joints.push_back(joint);
      hinges.q[first] = (*q)[balls.position_index(i)];
      continue;
    }
    const MassProperties body = ExpressIn(joint.body, X_turned);
    const std::string name = joint.name, link = joint.link;
    joint.type = JointType::kRevolute;
    joint.lower = -kPi;
    joint.upper = kPi;
    for (int k = 0; k < 3; ++k) {
      const Matrix3d R = MakeRotationFromZ(axes[k]);
      const Matrix3d R_before = k == 0 ? Matrix3d::Identity() : MakeRotationFromZ(axes[k - 1]);
      if (k > 0) joint.X_PB.setIdentity();
      if (k > 0) joint.parent = first + k - 1;
      joint.X_PB.linear() = joint.X_PB.linear() * R_before.transpose() * R;
      joint.name = name + std::to_string(k);
      joint.link = k == 2 ? link : link + std::to_string(k);
      joint.body = k == 2 ? body : MassProperties{};
      hinges.spec.joints.push_back(joint);
      hinges.q[first + k] = angle(*random);
    }
    const double p = hinges.q[first + 1], r = hinges.q[first + 2];
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(hinges.q[first], Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(p, Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(r, Vector3d::UnitX()));
    q->segment<4>(balls.position_index(i)) << turn.w(), turn.x(), turn.y(), turn.z();
    const double sp = std::sin(p), cp = std::cos(p), sr = std::sin(r), cr = std::cos(r);
    Matrix3d E;
    E << -sp, 0.0, 1.0, cp * sr, cr, 0.0, cp * cr, -sr, 0.0;
    const Matrix3d E_inverse = E.inverse();
    const Vector3d rates = E_inverse * xi.segment<3>(first);
    const double dp = rates[1], dr = rates[2];
    Matrix3d E_dot;
    E_dot << -cp * dp, 0.0, 0.0, -sp * sr * dp + cp * cr * dr, -sr * dr, 0.0, -sp * cr * dp - cp * sr * dr,
        -cr * dr, 0.0;
    hinges.T.block<3, 3>(first, first) = E_inverse;
    hinges.T_dot.block<3, 3>(first, first) = -E_inverse * E_dot * E_inverse;
  }
  for (Frame& frame : hinges.spec.frames) {
    if (is_ball(frame.link)) frame.X_LF = X_turned * frame.X_LF;
    frame.link = last_of(frame.link);
  }
  return hinges;
}

TEST(BallJoints, HaveTheTermsOfTheRobotOnHinges) {
  // Masses of some 20 kg over lengths of a few metres, chains of 20 joints, and E^-1 at pitch below 1.2 rad.
  constexpr double kRounding = 1e-11;
  std::mt19937 random(18);
  for (int sample = 0; sample < 5; ++sample) {
    RobotSpec spec = MakeRobot(BaseType::kFixed, &random);
    for (Joint& joint : spec.joints) {
      if (joint.type == JointType::kBall) joint.damping = joint.armature = 0.0;
    }
    const RobotModel model(spec);
    VectorXd q = DrawPositions(model, &random);
    const VectorXd xi = DrawVelocities(model.num_velocities(), &random);
    const OnHinges hinges = PutOnHinges(model, xi, &q, &random);
    const RobotModel on_hinges(hinges.spec);
    ModelTerms terms(model);
    ModelTerms others(on_hinges);
    terms.SetState(q, xi);
    terms.CalcDynamics();
    const VectorXd rates = hinges.T * xi;
    others.SetState(hinges.q, rates);
    others.CalcDynamics();
    const MatrixXd& T = hinges.T;
    EXPECT_TRUE(MatrixNear(terms.M(), T.transpose() * others.M() * T, kRounding));
    EXPECT_TRUE(
        MatrixNear(terms.C(), T.transpose() * (others.C() * T + others.M() * hinges.T_dot), kRounding));
    EXPECT_TRUE(MatrixNear(terms.gravity(), T.transpose() * others.gravity(), kRounding));
    for (int frame = 0; frame < static_cast<int>(model.frames().size()); ++frame) {
      EXPECT_TRUE(
          MatrixNear(terms.CalcFramePose(frame).matrix(), others.CalcFramePose(frame).matrix(), kRounding));
    }
  }
}

constexpr const char* kArm = R"(<mujoco model="arm"><compiler angle="radian"/><worldbody><body name="stand">
<body name="upper" pos="0 0 1" quat="0.9 0.1 0.3 -0.2">
<joint name="shoulder" type="ball" pos="0.01 0 0.02" damping="0.2" armature="0.01" limited="true" range="0 1.5"/>
<inertial pos="0.1 0.02 0" mass="2" diaginertia="0.01 0.02 0.025"/>
<body name="lower" pos="0.3 0 0"><joint name="elbow" axis="0 1 0"/>
<inertial pos="0.1 0 0.01" mass="1" diaginertia="0.004 0.006 0.008"/>
<body name="hand" pos="0.25 0 0"><joint name="reach" type="slide" axis="1 0 0"/><joint name="wrist" type="ball"/>
<inertial pos="0.05 0.01 0.02" mass="0.4" diaginertia="0.001 0.002 0.0025"/><site name="tip" pos="0.1 0 0"/>
</body></body></body></body></worldbody></mujoco>)";

TEST(BallJoints, MjcfIsImportedAndAgrees) {
  const MjModelPtr engine = LoadMjcfText(kArm, "arm.xml");
  const RobotDescription mjcf = ReadMjcfDescription(*engine, "arm.xml");
  EXPECT_EQ(ListFailures(CompareWithEngine(RobotModel(mjcf.spec), *engine)), "");
  const std::string text = WriteParameters(mjcf, "arm.xml");
  EXPECT_THAT(text, HasSubstr(R"({ joint = "shoulder", link = "upper", type = "ball", xyz = )"));
  EXPECT_THAT(text, HasSubstr(R"("shoulder" = { range = [0, 1.5], damping = 0.2, armature = 0.01)"));
  const RobotDescription table = ReadTable(text);
  EXPECT_EQ(table.spec.joints.size(), 4U);
  for (const CheckRecord& record : CompareWithEngine(RobotModel(table.spec), *engine).terms)
    EXPECT_LT(record.worst, 1e-13) << record.name;
  EXPECT_THAT(DescribeCoordinates(table),
              Contains(HasSubstr(R"(ball joints: "shoulder" has q[0..3] and xi[0..2], "wrist" has q[6..9] )"
                                 "and xi[5..7]: q = [qw qx qy qz] turns the link against its parent, xi = "
                                 "its angular velocity against the parent in the link's own axes")));
  const AuditResult audit = AuditRobot(mjcf);
  EXPECT_TRUE(audit.IsGood()) << audit.findings.at(0).text;
}

TEST(BallJoints, FaultsAreFound) {
  const MjModelPtr engine = LoadMjcfText(kArm, "arm.xml");
  const RobotDescription mjcf = ReadMjcfDescription(*engine, "arm.xml");
  const auto compare = [&](const auto& change) {
    RobotSpec spec = mjcf.spec;
    change(&spec);
    return ListFailures(CompareWithEngine(RobotModel(spec), *engine));
  };
  // The frame in whose axes the velocity is written, the point about which the link turns, damping, range.
  const auto turn = [](RobotSpec* spec) {
    const Matrix3d R = Eigen::AngleAxisd(0.5, Vector3d::UnitZ()).toRotationMatrix();
    Pose X = Pose::Identity();
    X.linear() = R;
    spec->joints[0].X_PB = spec->joints[0].X_PB * X;
    spec->joints[0].body = ExpressIn(spec->joints[0].body, X.inverse());
    spec->joints[1].X_PB = X.inverse() * spec->joints[1].X_PB;
  };
  EXPECT_THAT(compare(turn), HasSubstr("joint_axis "));
  EXPECT_THAT(compare(turn), HasSubstr("M_bar "));
  EXPECT_THAT(compare([](RobotSpec* spec) { spec->joints[0].X_PB.translation().x() += 1e-6; }),
              HasSubstr("joint_axis "));
  EXPECT_THAT(compare([](RobotSpec* spec) { spec->joints[0].damping = 0.3; }), HasSubstr("joint_damping "));
  EXPECT_THAT(compare([](RobotSpec* spec) { spec->joints[0].upper = 1.4; }), HasSubstr("joint_range "));
  RobotDescription wrong = mjcf;
  wrong.spec.joints[0].body.mass *= 1000.0;
  wrong.spec.joints[0].body.inertia *= 1000.0;
  wrong.parts.clear();
  const FileCauses found = FindCauses(PrintDescription(wrong), PrintDescription(mjcf));
  ASSERT_EQ(found.items.size(), 2U) << ::testing::PrintToString(ListLines(found));
  std::set<std::string> ids;
  for (const CorrectionItem& cause : found.items) {
    ids.insert(cause.id);
    EXPECT_EQ(cause.places, std::vector<std::string>{"link upper"});
  }
  EXPECT_EQ(ids, (std::set<std::string>{"mass.g", "inertia.g_m2"}));
}

TEST(BallJoints, ALayoutHasFourPositionsAndThreeVelocities) {
  const RobotDescription robot = ReadMjcfDescription(*LoadMjcfText(kArm, "arm.xml"), "arm.xml");
  const nlohmann::json json = {{"joints", {"wrist", "reach", "elbow", "shoulder"}}};
  const ProgramLayout layout(robot, json, "program");
  EXPECT_EQ(layout.num_positions(), 10);
  EXPECT_EQ(layout.size(), 8);
  VectorXd q(10), xi(8);
  q << 1, 2, 3, 4, 5, 6, 7, 8, 9, 10;
  xi << 1, 2, 3, 4, 5, 6, 7, 8;
  EXPECT_THAT(layout.WritePositions(q), ElementsAre(7, 8, 9, 10, 6, 5, 1, 2, 3, 4));
  EXPECT_THAT(layout.WriteVelocities(q, xi), ElementsAre(6, 7, 8, 5, 4, 1, 2, 3));
  TermResults terms;
  terms.gravity = layout.WriteVelocities(q, xi);
  layout.ReadTerms(q, xi, &terms);
  EXPECT_EQ(terms.gravity, xi);
  EXPECT_EQ(layout.ToJson().at("joints").dump(), json.at("joints").dump());
}

TEST(BallJoints, TablesAreRefusedWithAReason) {
  const std::string good =
      WriteParameters(ReadMjcfDescription(*LoadMjcfText(kArm, "arm.xml"), "arm.xml"), "arm.xml");
  const auto expect = [&](const std::string& original, const std::string& changed,
                          const std::string& message) {
    EXPECT_TRUE(Throws<InputError>([&] { ReadTable(ReplaceFirst(good, original, changed)); }, message));
  };
  expect("[0, 1.5]", "[-1, 1.5]", "must begin at 0 for a ball joint");
  expect(R"(type = "ball")", R"(axis = [0, 1, 0], type = "ball")", "axis");
  expect("armature = 0.01", R"(armature = 0.01, mimic = { joint = "elbow" })",
         "must not be given for a ball");
  expect(R"("elbow" = { range)", R"("elbow" = { mimic = { joint = "shoulder" }, range)", "must be no ball");
}

}  // namespace
}  // namespace dexcheck::testing::ball_joints_test
