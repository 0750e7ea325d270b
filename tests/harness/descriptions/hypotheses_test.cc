// Faults that people make, on one link and on all, on four robots: each is named in words, and nothing else
// is.

#include "harness/descriptions/hypotheses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <functional>
#include <ostream>

#include "controller/model/body_frame.h"
#include "harness/descriptions/read_description.h"
#include "tests/common/legged_robots.h"
#include "tests/common/matchers.h"
#include "tests/common/paths.h"
#include "tests/harness/descriptions/robot_pairs.h"

namespace dexcheck::testing::hypotheses_test {
namespace {

using Pair = testing::RobotPair;
const std::vector<Pair>& ListRobots() { return testing::ListRobotPairs(); }

/// What a person may have done to a body, in the link's own frame.
struct BodyFault {
  std::string name;
  std::string text;
  std::function<MassProperties(const RobotDescription&, size_t, MassProperties)> make;
};

Matrix3d CalcOffset(const MassProperties& body) {
  return body.mass * (body.com.squaredNorm() * Matrix3d::Identity() - body.com * body.com.transpose());
}

/// Of bodies that are one part; the identity, which makes no fault, of others.
Matrix3d FindPartRotation(const RobotDescription& robot, size_t joint) {
  std::vector<Matrix3d> rotations;
  for (const DescribedPart& part : robot.parts) {
    if (part.joint == static_cast<int>(joint) && part.states_inertial)
      rotations.push_back(part.X_LC.linear());
  }
  return rotations.size() == 1 ? rotations[0] : Matrix3d(Matrix3d::Identity());
}

Pose FindPlace(const RobotDescription& robot, size_t joint) { return ListOwnRows(robot)[joint].X_PL; }

const std::vector<BodyFault>& ListFaults() {
  using Body = MassProperties;
  using Robot = RobotDescription;
  static const std::vector<BodyFault> faults = {
      {"Origin", "as if given about the link's origin",
       [](const Robot&, size_t, Body body) { return body.inertia += CalcOffset(body), body; }},
      {"Signs", "with the products' sign turned around",
       [](const Robot&, size_t, Body body) {
         const Vector3d diagonal = body.inertia.diagonal();
         body.inertia = -body.inertia;
         body.inertia.diagonal() = diagonal;
         return body;
       }},
      {"NoProducts", "without its products",
       [](const Robot&, size_t, Body body) {
         return body.inertia = Matrix3d(body.inertia.diagonal().asDiagonal()), body;
       }},
      {"PrincipalMoments", "of principal moments without their axes",
       [](const Robot&, size_t, Body body) {
         const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(body.inertia);
         return body.inertia = Matrix3d(solver.eigenvalues().asDiagonal()), body;
       }},
      {"Transposed", "turned the other way",
       [](const Robot& robot, size_t i, Body body) {
         // The file has R^T where R would be right: I = R I_C R^T, read as R^T I_C R.
         const Matrix3d R = FindPartRotation(robot, i);
         return body.inertia = R.transpose() * R.transpose() * body.inertia * R * R, body;
       }},
      {"AxesXY", "with the axes x and y exchanged",
       [](const Robot&, size_t, Body body) {
         Matrix3d P;
         P << 0, 1, 0, 1, 0, 0, 0, 0, 1;
         return body.inertia = P * body.inertia * P, body;
       }},
      {"GramMillimetres", "as if in g mm^2",
       [](const Robot&, size_t, Body body) { return body.inertia *= 1e9, body; }},
      {"KilogramMillimetres", "as if in kg mm^2",
       [](const Robot&, size_t, Body body) { return body.inertia *= 1e6, body; }},
      {"Grams", "as if in g", [](const Robot&, size_t, Body body) { return body.mass *= 1e3, body; }},
      {"Pounds", "as if in lb",
       [](const Robot&, size_t, Body body) { return body.mass /= 0.45359237, body; }},
      {"ComMillimetres", "as if in mm",
       [](const Robot&, size_t, Body body) { return body.com *= 1e3, body; }},
      {"ComOfParent", "as if given in the parent's frame",
       [](const Robot& robot, size_t i, Body body) {
         return body.com = FindPlace(robot, i) * body.com, body;
       }},
      {"ComSign", "with its sign turned around",
       [](const Robot&, size_t, Body body) { return body.com = -body.com, body; }},
      {"ComOrder", "in the order y, z, x",
       [](const Robot&, size_t, Body body) {
         return body.com = Vector3d(body.com[1], body.com[2], body.com[0]), body;
       }},
      {"Order", "in the order xx, xy, xz, yy, yz, zz", [](const Robot&, size_t, Body body) {
         const Matrix3d I = body.inertia;
         // The numbers xx, xy, xz, yy, yz, zz stand where xx, yy, zz, xy, xz, yz are read.
         body.inertia << I(0, 0), I(1, 1), I(1, 2), I(1, 1), I(0, 1), I(2, 2), I(1, 2), I(2, 2), I(0, 2);
         return body;
       }}};
  return faults;
}

/// Own frames stand on the axis in ListOwnRows; a URDF's do so already.
void Spoil(const BodyFault& fault, size_t i, RobotDescription* robot) {
  const Pose& X_iL = robot->joints[i].X_iL;
  MassProperties& body = robot->spec.joints[i].body;
  body = ExpressIn(fault.make(*robot, i, ExpressIn(body, X_iL.inverse())), X_iL);
  if (fault.name != "Transposed") return;
  const Matrix3d R = FindPartRotation(*robot, i);
  for (DescribedPart& part : robot->parts) {
    if (part.joint == static_cast<int>(i) && part.states_inertial && part.X_LC.linear() == R) {
      part.X_LC.linear() = R.transpose();
    }
  }
}

std::string List(const std::vector<Hypothesis>& found) {
  std::string text;
  for (const Hypothesis& hypothesis : found) text += hypothesis.text + "\n";
  return text;
}

bool IsVisible(const RobotDescription& robot, const RobotDescription& spoiled, size_t i) {
  const MassProperties& a = robot.spec.joints[i].body;
  const MassProperties& b = spoiled.spec.joints[i].body;
  return std::abs(a.mass - b.mass) > 1e-4 * a.mass || (a.com - b.com).norm() > 1e-4 ||
         (a.inertia - b.inertia).norm() > 1e-4 * a.inertia.trace();
}

struct Case {
  int robot;
  int fault;
};
void PrintTo(const Case& tried, std::ostream* out) {
  *out << ListRobots()[static_cast<size_t>(tried.robot)].name
       << ListFaults()[static_cast<size_t>(tried.fault)].name;
}

class BodyFaults : public ::testing::TestWithParam<Case> {
 protected:
  [[nodiscard]] const Pair& pair() const { return ListRobots()[static_cast<size_t>(GetParam().robot)]; }
  [[nodiscard]] const BodyFault& fault() const { return ListFaults()[static_cast<size_t>(GetParam().fault)]; }
};

TEST_P(BodyFaults, OfAllLinksAreNamedInOneLine) {
  RobotDescription wrong = pair().a;
  size_t visible = 0;
  for (size_t i = 0; i < wrong.spec.joints.size(); ++i) {
    Spoil(fault(), i, &wrong);
    visible += IsVisible(pair().a, wrong, i) ? 1 : 0;
  }
  if (visible < 2) GTEST_SKIP() << "the robot's bodies do not show it";
  const std::vector<Hypothesis> found = ExplainDifference(wrong, pair().b);
  ASSERT_FALSE(found.empty());
  EXPECT_THAT(List(found), HasSubstr(fault().text));
  double explained = 0.0;
  for (const Hypothesis& hypothesis : found) explained += hypothesis.explained;
  EXPECT_NEAR(explained, 1.0, 1e-6) << List(found);
  // Symmetric bodies may look like something simpler; the others are one line.
  EXPECT_LE(found.size(), 3U) << List(found);
}

TEST_P(BodyFaults, OfOneLinkNameTheLink) {
  for (size_t i = 0; i < pair().a.spec.joints.size(); ++i) {
    RobotDescription wrong = pair().a;
    Spoil(fault(), i, &wrong);
    if (!IsVisible(pair().a, wrong, i)) continue;
    const std::vector<Hypothesis> found = ExplainDifference(wrong, pair().b);
    ASSERT_EQ(found.size(), 1U) << List(found);
    EXPECT_THAT(found[0].text, StartsWith("link " + pair().a.spec.joints[i].link + ": its "));
    EXPECT_NEAR(found[0].explained, 1.0, 1e-6);
    ASSERT_EQ(found[0].values.size(), 1U);
    EXPECT_THAT(found[0].values[0], HasSubstr("; right would be mass "));
    return;
  }
  GTEST_SKIP() << "the robot's bodies do not show it";
}

std::vector<Case> ListCases() {
  std::vector<Case> cases;
  for (int robot = 0; robot < 4; ++robot) {
    for (int fault = 0; fault < static_cast<int>(ListFaults().size()); ++fault)
      cases.push_back({robot, fault});
  }
  return cases;
}

INSTANTIATE_TEST_SUITE_P(Hypotheses, BodyFaults, ::testing::ValuesIn(ListCases()));

TEST(Hypotheses, NothingIsSaidOfRobotsThatAgree) {
  for (const Pair& pair : ListRobots()) EXPECT_EQ(List(ExplainDifference(pair.a, pair.b)), "") << pair.name;
}

// What no convention explains is left to the numbers.
TEST(Hypotheses, NothingIsSaidOfOtherNumbers) {
  for (const Pair& pair : ListRobots()) {
    RobotDescription wrong = pair.a;
    for (Joint& joint : wrong.spec.joints) {
      joint.body.mass *= 1.2345;
      joint.body.inertia *= 1.321;
      joint.body.com += Vector3d(0.0123, -0.0456, 0.0789);
    }
    EXPECT_EQ(List(ExplainDifference(wrong, pair.b)), "") << pair.name;
  }
}

TEST(Hypotheses, ListsThatAreShiftedAndBodiesThatAreExchanged) {
  for (const Pair& pair : ListRobots()) {
    // In own frames, as tables have them.
    const auto own = [&](const RobotDescription& robot, size_t i) {
      return ExpressIn(robot.spec.joints[i].body, robot.joints[i].X_iL.inverse());
    };
    RobotDescription shifted = pair.a;
    const size_t n = shifted.spec.joints.size();
    for (size_t i = 0; i + 1 < n; ++i) {
      shifted.spec.joints[i].body = ExpressIn(own(pair.a, i + 1), pair.a.joints[i].X_iL);
    }
    if (pair.name != "humanoid") {  // whose list is a tree
      EXPECT_THAT(List(ExplainDifference(shifted, pair.b)),
                  HasSubstr("the list of bodies looks shifted by one"))
          << pair.name;
    }
    RobotDescription exchanged = pair.a;
    exchanged.spec.joints[1].body = ExpressIn(own(pair.a, 2), pair.a.joints[1].X_iL);
    exchanged.spec.joints[2].body = ExpressIn(own(pair.a, 1), pair.a.joints[2].X_iL);
    const std::string links = pair.a.spec.joints[1].link + " and " + pair.a.spec.joints[2].link;
    EXPECT_EQ(List(ExplainDifference(exchanged, pair.b)),
              "links " + links + ": their bodies look exchanged\n");
    RobotDescription inertias = pair.a;
    MassProperties first = own(pair.a, 1);
    MassProperties second = own(pair.a, 2);
    std::swap(first.inertia, second.inertia);
    inertias.spec.joints[1].body = ExpressIn(first, pair.a.joints[1].X_iL);
    inertias.spec.joints[2].body = ExpressIn(second, pair.a.joints[2].X_iL);
    EXPECT_EQ(List(ExplainDifference(inertias, pair.b)),
              "links " + links + ": their inertias look exchanged\n");
  }
}

TEST(Hypotheses, ALostPartIsNamed) {
  const std::vector<testing::LeggedLink> links = testing::ListQuadruped();
  std::string text = testing::WriteLeggedUrdf("quadruped", links);
  const RobotDescription right = ParseUrdf(text, "right.urdf");
  const size_t begin = text.find("<inertial>", text.find("<link name=\"FR_foot\">"));
  const size_t end = text.find("</inertial>", begin) + std::string("</inertial>").size();
  text.erase(begin, end - begin);
  EXPECT_EQ(List(ExplainDifference(ParseUrdf(text, "wrong.urdf"), right)),
            "link FR_calf: the mass of \"FR_foot\", which is welded to it, looks lost\n");
}

/// A quadruped whose feet, welded to the calves, have generic bodies.
RobotDescription ReadWeldedRobot() {
  std::vector<testing::LeggedLink> links = testing::ListQuadruped();
  for (testing::LeggedLink& link : links) {
    if (link.has_joint) continue;
    link.com = "0.01 0.02 -0.015";
    link.com_rpy = "0.3 -0.2 0.5";
    link.moments = "0.00003 0.00005 0.00006";
    link.rpy = "0.2 0.4 -0.3";
    link.xyz = "0.01 -0.02 -0.213";
  }
  return ParseUrdf(testing::WriteLeggedUrdf("quadruped", links), "robot.urdf");
}

/// What a file says of its parts makes the bodies.
void CombineParts(RobotDescription* robot) {
  for (int i = -1; i < static_cast<int>(robot->spec.joints.size()); ++i) {
    std::vector<MassProperties> parts;
    for (const DescribedPart& part : robot->parts) {
      if (part.joint == i && part.states_inertial) parts.push_back(ExpressIn(part.body, part.X_iL));
    }
    (i < 0 ? robot->spec.base.body : robot->spec.joints[static_cast<size_t>(i)].body) = Combine(parts);
  }
}

DescribedPart& FindPart(const std::string& name, RobotDescription* robot) {
  return *std::find_if(robot->parts.begin(), robot->parts.end(),
                       [&](const DescribedPart& part) { return part.name == name; });
}

TEST(Hypotheses, FaultsOfOneWeldedPartAreNamed) {
  const RobotDescription right = ReadWeldedRobot();
  RobotDescription fused = right;  // the other file may have one body in the place of the parts
  fused.parts.clear();
  const auto rotation = [](DescribedPart& part, const Matrix3d& R) { part.X_iL.linear() = R; };
  const struct {
    std::string text;
    std::function<void(DescribedPart&)> make;
    bool of_place = false;
  } kCases[] = {
      {"the inertia of its part \"FR_foot\" looks as if given about the link's origin",
       [](DescribedPart& part) { part.body.inertia += CalcOffset(part.body); }},
      {"the inertia of its part \"FR_foot\" looks as if given about the origin of the link that carries it",
       [](DescribedPart& part) {
         MassProperties in_link = ExpressIn(part.body, part.X_iL);
         in_link.inertia += CalcOffset(in_link);
         part.body = ExpressIn(in_link, part.X_iL.inverse());
       }},
      {"the mass of its part \"FR_foot\" looks as if in g",
       [](DescribedPart& part) { part.body.mass *= 1e3; }},
      {"the mass with its inertia of its part \"FR_foot\" looks doubled",
       [](DescribedPart& part) {
         part.body.mass *= 2.0;
         part.body.inertia *= 2.0;
       }},
      {"the inertia of its part \"FR_foot\" looks as if in kg mm^2",
       [](DescribedPart& part) { part.body.inertia *= 1e6; }},
      {"the centre of mass of its part \"FR_foot\" looks as if in mm",
       [](DescribedPart& part) { part.body.com *= 1e3; }},
      {"the centre of mass of its part \"FR_foot\" looks as if given in the parent's frame",
       [](DescribedPart& part) { part.body.com = part.X_iL * part.body.com; }},
      {"its part \"FR_foot\" looks as if it stood at the origin of the link",
       [](DescribedPart& part) { part.X_iL.setIdentity(); }, true},
      {"its part \"FR_foot\" looks as if it were welded on without the rotation of its weld",
       [&](DescribedPart& part) { rotation(part, Matrix3d::Identity()); }, true},
      {"its part \"FR_foot\" looks as if it were welded on with the rotation transposed",
       [&](DescribedPart& part) { rotation(part, Matrix3d(part.X_iL.linear().transpose())); }, true},
      {"its part \"FR_foot\" looks as if it were welded on without the translation of its weld",
       [](DescribedPart& part) { part.X_iL.translation().setZero(); }, true}};
  // A part is placed in frame i; its weld stands in the link's own frame.
  for (const auto& one : kCases) {
    RobotDescription wrong = right;
    DescribedPart& part = FindPart("FR_foot", &wrong);
    const Pose X_iL = FindPart("FR_calf", &wrong).X_iL;
    part.X_iL = X_iL.inverse() * part.X_iL;
    one.make(part);
    part.X_iL = X_iL * part.X_iL;
    CombineParts(&wrong);
    const std::string found = List(ExplainDifference(wrong, right));
    EXPECT_THAT(found, StartsWith("link FR_calf: " + one.text));
    EXPECT_EQ(std::count(found.begin(), found.end(), '\n'), 1) << found;
    if (!one.of_place) {
      EXPECT_THAT(List(ExplainDifference(wrong, fused)), StartsWith("link FR_calf: " + one.text));
    }
  }
}

// Each file's parts are given about their own links' origins: one sentence says it of all.
TEST(Hypotheses, AFaultInAllPartsIsOneFault) {
  const RobotDescription right = ReadWeldedRobot();
  RobotDescription wrong = right;
  for (DescribedPart& part : wrong.parts) part.body.inertia += CalcOffset(part.body);
  CombineParts(&wrong);
  LetBaseFloat(&wrong);
  RobotDescription floating = right;
  LetBaseFloat(&floating);
  EXPECT_EQ(List(ExplainDifference(wrong, floating)),
            "all inertias look as if given about the link's origin instead of the centre of mass: 13 of 13 "
            "links\n");
}

TEST(Hypotheses, NothingIsSaidOfOtherNumbersOfAPart) {
  const RobotDescription right = ReadWeldedRobot();
  RobotDescription wrong = right;
  DescribedPart& part = FindPart("FR_foot", &wrong);
  part.body.mass *= 1.2345;
  part.body.inertia *= 1.321;
  part.body.com += Vector3d(0.0123, -0.0456, 0.0789);
  CombineParts(&wrong);
  EXPECT_EQ(List(ExplainDifference(wrong, right)), "");
}

/// What a person may have done to a joint.
struct JointFaultCase {
  std::string name;
  std::string text;
  std::function<void(size_t, RobotDescription*)> make;
};

/// The link's own frame and what hangs on it stay where they are; frame i, whose z is the axis, is turned.
void TurnAxisAround(size_t i, RobotDescription* robot) {
  const Pose turn(Eigen::AngleAxisd(kPi, Vector3d::UnitX()));
  Joint& joint = robot->spec.joints[i];
  joint.X_PB = joint.X_PB * turn;
  joint.body = ExpressIn(joint.body, turn.inverse());
  robot->joints[i].X_iL = turn.inverse() * robot->joints[i].X_iL;
  for (Joint& child : robot->spec.joints) {
    if (child.parent == static_cast<int>(i)) child.X_PB = turn.inverse() * child.X_PB;
  }
}

class JointFaults : public ::testing::TestWithParam<JointFaultCase> {};

TEST_P(JointFaults, AreNamed) {
  int named = 0;
  for (const Pair& pair : ListRobots()) {
    for (const size_t i : {size_t{1}, size_t{3}}) {
      RobotDescription wrong = pair.a;
      GetParam().make(i, &wrong);
      if (wrong.spec.joints[i].type != JointType::kRevolute) continue;
      const std::vector<Hypothesis> found = ExplainDifference(wrong, pair.b);
      if (found.empty() && wrong.spec.joints[i].X_PB.isApprox(pair.a.spec.joints[i].X_PB)) continue;
      ASSERT_EQ(found.size(), 1U) << pair.name << " " << i << "\n" << List(found);
      EXPECT_THAT(found[0].text, StartsWith("joint " + wrong.spec.joints[i].name + ": its ")) << pair.name;
      EXPECT_NEAR(found[0].explained, 1.0, 1e-12);
      named += found[0].text.find(GetParam().text) != std::string::npos ? 1 : 0;
    }
  }
  EXPECT_GE(named, 3);
}

INSTANTIATE_TEST_SUITE_P(Hypotheses, JointFaults,
                         ::testing::Values(JointFaultCase{"Zero", "zero looks offset by 30 deg",
                                                          [](size_t i, RobotDescription* robot) {
                                                            robot->spec.joints[i].mdh.q += DegToRad(30.0);
                                                          }},
                                           JointFaultCase{"Sign", "axis looks turned around (its sign)",
                                                          TurnAxisAround},
                                           JointFaultCase{"Millimetres", "origin looks as if in mm",
                                                          [](size_t i, RobotDescription* robot) {
                                                            robot->spec.joints[i].X_PB.translation() *= 1e3;
                                                          }},
                                           JointFaultCase{"OriginSign", "origin looks turned around",
                                                          [](size_t i, RobotDescription* robot) {
                                                            robot->spec.joints[i].X_PB.translation() *= -1.0;
                                                          }}),
                         [](const auto& named) { return named.param.name; });

TEST(Hypotheses, GravityAndUnitsOfJoints) {
  RobotDescription table = ReadDescription(testing::SourcePath("/controller/parameters/panda.toml"));
  const RobotDescription mjcf = ReadDescription(testing::SourcePath("/mjcf/panda.xml"));
  EXPECT_EQ(List(ExplainDifference(table, mjcf)), "");
  RobotDescription wrong = table;
  wrong.spec.gravity *= -1.0;
  EXPECT_EQ(List(ExplainDifference(wrong, mjcf)), "gravity looks turned around (its sign)\n");
  wrong.spec.gravity = Vector3d(0.0, 0.0, -9.8);
  EXPECT_EQ(List(ExplainDifference(wrong, mjcf)), "gravity has the right direction and another value\n");
  wrong.spec.gravity = Vector3d(0.0, -9.81, 0.0);
  EXPECT_EQ(List(ExplainDifference(wrong, mjcf)), "gravity points along another axis\n");
  wrong = table;
  for (Joint& joint : wrong.spec.joints) {
    joint.lower = RadToDeg(joint.lower);
    joint.upper = RadToDeg(joint.upper);
  }
  EXPECT_EQ(List(ExplainDifference(wrong, mjcf)), "ranges look as if in degrees: 7 of 7 joints\n");
}

// Tables of the Panda that were read by another convention.
TEST(Hypotheses, TablesThatAreMisread) {
  const RobotDescription right = ReadDescription(testing::SourcePath("/controller/parameters/panda.toml"));
  const RobotDescription mjcf = ReadDescription(testing::SourcePath("/mjcf/panda.xml"));
  RobotDescription degrees = right;
  for (Joint& joint : degrees.spec.joints) joint.mdh.alpha = RadToDeg(joint.mdh.alpha);
  EXPECT_EQ(List(ExplainDifference(degrees, mjcf)),
            "alpha and q of the rows look as if in degrees: 7 of 7 joints\n");
  RobotDescription millimetres = right;
  for (Joint& joint : millimetres.spec.joints) {
    joint.mdh.a *= 1e3;
    joint.mdh.d *= 1e3;
  }
  EXPECT_EQ(List(ExplainDifference(millimetres, mjcf)),
            "a and d of the rows look as if in mm: 7 of 7 joints\n");
  RobotDescription signs = right;
  for (Joint& joint : signs.spec.joints) joint.mdh.alpha *= -1.0;
  EXPECT_EQ(List(ExplainDifference(signs, mjcf)),
            "alpha of all rows looks turned around (its sign): 7 of 7 joints\n");

  // The same arm by classic rows (q, d, a, alpha of each joint, and bodies in their frames), read as
  // modified.
  RobotDescription classic = right;
  classic.spec.frames.clear();
  for (size_t i = 0; i < classic.spec.joints.size(); ++i) {
    Joint& joint = classic.spec.joints[i];
    const bool is_last = i + 1 == classic.spec.joints.size();
    const MdhRow next = is_last ? MdhRow{} : right.spec.joints[i + 1].mdh;
    joint.mdh.alpha = next.alpha;
    joint.mdh.a = next.a;
    const Pose X_iL =
        Eigen::Translation3d(next.a, 0.0, 0.0) * Eigen::AngleAxisd(next.alpha, Vector3d::UnitX());
    joint.body = ExpressIn(right.spec.joints[i].body, X_iL.inverse());
  }
  EXPECT_EQ(List(ExplainDifference(classic, mjcf)),
            "the rows look like classic (standard) Denavit-Hartenberg parameters, and are read as modified "
            "ones: 7 of "
            "7 joints\n");
}

}  // namespace
}  // namespace dexcheck::testing::hypotheses_test
