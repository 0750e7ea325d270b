// Faults that people make, on one link and on all, on four robots: each is named in words, and nothing else
// is.

#include "harness/descriptions/hypotheses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <ostream>

#include "controller/model/rigid_body.h"
#include "harness/descriptions/read_description.h"
#include "tests/common/legged_robots.h"
#include "tests/common/matchers.h"
#include "tests/common/paths.h"
#include "tests/harness/descriptions/robot_pairs.h"

namespace dexcheck::testing::hypotheses_test {
namespace {

// Of bodies, those whose every case must be named (faults_measurement_test counts the others).
constexpr const char* kBodyFaults[] = {"inertia as if given about the link's origin",
                                       "inertia with the products' sign turned around",
                                       "inertia without its products",
                                       "inertia of principal moments without their axes",
                                       "inertia with the axes x and y exchanged",
                                       "inertia as if in g mm^2",
                                       "inertia as if in kg mm^2",
                                       "inertia in the order xx, xy, xz, yy, yz, zz",
                                       "mass as if in g",
                                       "mass as if in lb",
                                       "centre as if in mm",
                                       "centre as if given in the parent's frame",
                                       "centre with its sign turned around",
                                       "centre in the order y, z, x"};

/// The file has R^T where R would be right: I = R I_C R^T, read as R^T I_C R. Of bodies that are one part.
/// @return whether the part's frame is turned at all.
bool TransposeAxes(size_t i, RobotDescription* robot) {
  std::vector<DescribedPart*> parts;
  for (DescribedPart& part : robot->parts) {
    if (part.joint == static_cast<int>(i) && part.states_inertial) parts.push_back(&part);
  }
  if (parts.size() != 1 || parts[0]->X_LC.linear().isIdentity()) return false;
  const Matrix3d R = parts[0]->X_LC.linear();
  const ConventionFault fault = {"", "", [&](StatedLink* link) {
                                   link->body.inertia =
                                       R.transpose() * R.transpose() * link->body.inertia * R * R;
                                 }};
  parts[0]->X_LC.linear() = R.transpose();
  return SpoilLink(fault, i, robot);
}

/// Makes a fault of the list at one link, or the axes' transposition, which has no entry there.
bool Spoil(const std::string& fault, size_t i, RobotDescription* robot) {
  return fault.empty() ? TransposeAxes(i, robot) : SpoilLink(FindConventionFault(fault), i, robot);
}

std::string List(const std::vector<Hypothesis>& found) {
  std::string text;
  for (const Hypothesis& hypothesis : found) text += hypothesis.text + "\n";
  return text;
}

std::string Say(const RobotDescription& wrong, const RobotDescription& right) {
  return List(ExplainDifference(wrong, right));
}

/// What is said when every joint is changed.
std::string SayOfJoints(RobotDescription robot, const RobotDescription& right,
                        const std::function<void(Joint&)>& change) {
  std::ranges::for_each(robot.spec.joints, change);
  return Say(robot, right);
}

/// Whether it says so, alone or as one of several that cannot be told apart.
bool Names(const Hypothesis& found, const std::string& id) {
  return std::ranges::find(found.ids, id) != found.ids.end();
}

struct Case {
  int robot;
  std::string fault;  ///< Empty for transposed axes.
};
void PrintTo(const Case& tried, std::ostream* out) {
  *out << ListRobotPairs()[static_cast<size_t>(tried.robot)].name << " " << tried.fault;
}

class BodyFaults : public ::testing::TestWithParam<Case> {
 protected:
  [[nodiscard]] const RobotPair& pair() const {
    return ListRobotPairs()[static_cast<size_t>(GetParam().robot)];
  }
  [[nodiscard]] static std::string id() {
    const std::string& fault = GetParam().fault;
    return fault.empty() ? "inertia.frame_transposed" : FindConventionFault(fault).ids[0];
  }
};

TEST_P(BodyFaults, OfAllLinksAreNamedInOneLine) {
  RobotDescription wrong = pair().a;
  size_t visible = 0;
  for (size_t i = 0; i < wrong.spec.joints.size(); ++i) visible += Spoil(GetParam().fault, i, &wrong) ? 1 : 0;
  if (visible < 2) GTEST_SKIP() << "the robot's bodies do not show it";
  const std::vector<Hypothesis> found = ExplainDifference(wrong, pair().b);
  ASSERT_FALSE(found.empty());
  EXPECT_TRUE(std::ranges::any_of(found, [](const Hypothesis& one) { return Names(one, id()); }))
      << List(found);
  double explained = 0.0;
  for (const Hypothesis& hypothesis : found) explained += hypothesis.explained;
  EXPECT_NEAR(explained, 1.0, 1e-6) << List(found);
  // Symmetric bodies may look like something simpler; the others are one line.
  EXPECT_LE(found.size(), 3U) << List(found);
}

TEST_P(BodyFaults, OfOneLinkNameTheLink) {
  for (size_t i = 0; i < pair().a.spec.joints.size(); ++i) {
    RobotDescription wrong = pair().a;
    if (!Spoil(GetParam().fault, i, &wrong)) continue;
    const std::vector<Hypothesis> found = ExplainDifference(wrong, pair().b);
    ASSERT_EQ(found.size(), 1U) << List(found);
    EXPECT_EQ(found[0].parts, std::vector<std::string>{pair().a.spec.joints[i].link});
    EXPECT_TRUE(Names(found[0], id())) << List(found);
    EXPECT_NEAR(found[0].explained, 1.0, 1e-6);
    ASSERT_EQ(found[0].values.size(), 1U);
    EXPECT_THAT(found[0].values[0], HasSubstr("; right would be "));
    return;
  }
  GTEST_SKIP() << "the robot's bodies do not show it";
}

std::vector<Case> ListCases() {
  std::vector<Case> cases;
  for (int robot = 0; robot < 4; ++robot) {
    cases.push_back({robot, ""});
    for (const char* fault : kBodyFaults) cases.push_back({robot, fault});
  }
  return cases;
}

INSTANTIATE_TEST_SUITE_P(Hypotheses, BodyFaults, ::testing::ValuesIn(ListCases()));

TEST(Hypotheses, NothingIsSaidOfRobotsThatAgree) {
  for (const RobotPair& pair : ListRobotPairs()) EXPECT_EQ(Say(pair.a, pair.b), "") << pair.name;
}

void ChangeNumbers(MassProperties* body) {
  body->mass *= 1.2345;
  body->inertia *= 1.321;
  body->com += Vector3d(0.0123, -0.0456, 0.0789);
}

// What no convention explains is left to the numbers.
TEST(Hypotheses, NothingIsSaidOfOtherNumbers) {
  for (const RobotPair& pair : ListRobotPairs()) {
    EXPECT_EQ(SayOfJoints(pair.a, pair.b, [](Joint& joint) { ChangeNumbers(&joint.body); }), "") << pair.name;
  }
}

TEST(Hypotheses, ListsThatAreShiftedAndBodiesThatAreExchanged) {
  for (const RobotPair& pair : ListRobotPairs()) {
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
      EXPECT_THAT(Say(shifted, pair.b), HasSubstr("the list of bodies looks shifted by one")) << pair.name;
    }
    const auto give = [&](const MassProperties& first, const MassProperties& second) {
      RobotDescription robot = pair.a;
      robot.spec.joints[1].body = ExpressIn(first, pair.a.joints[1].X_iL);
      robot.spec.joints[2].body = ExpressIn(second, pair.a.joints[2].X_iL);
      return Say(robot, pair.b);
    };
    const std::string links = pair.a.spec.joints[1].link + " and " + pair.a.spec.joints[2].link;
    MassProperties first = own(pair.a, 1);
    MassProperties second = own(pair.a, 2);
    EXPECT_EQ(give(second, first), "links " + links + ": their bodies look exchanged\n");
    std::swap(first.inertia, second.inertia);
    EXPECT_EQ(give(first, second), "links " + links + ": their inertias look exchanged\n");
  }
}

TEST(Hypotheses, ALostPartIsNamed) {
  const std::vector<LeggedLink> links = ListQuadruped();
  std::string text = WriteLeggedUrdf("quadruped", links);
  const RobotDescription right = ParseUrdf(text, "right.urdf");
  const size_t begin = text.find("<inertial>", text.find(R"(<link name="FR_foot">)"));
  const size_t end = text.find("</inertial>", begin) + std::string("</inertial>").size();
  text.erase(begin, end - begin);
  EXPECT_EQ(Say(ParseUrdf(text, "wrong.urdf"), right),
            "link FR_calf: the mass of \"FR_foot\", which is welded to it, looks lost\n");
}

/// A quadruped whose feet, welded to the calves, have generic bodies.
RobotDescription ReadWeldedRobot() {
  std::vector<LeggedLink> links = ListQuadruped();
  for (LeggedLink& link : links) {
    if (link.has_joint) continue;
    link.com = "0.01 0.02 -0.015";
    link.com_rpy = "0.3 -0.2 0.5";
    link.moments = "0.00003 0.00005 0.00006";
    link.rpy = "0.2 0.4 -0.3";
    link.xyz = "0.01 -0.02 -0.213";
  }
  return ParseUrdf(WriteLeggedUrdf("quadruped", links), "robot.urdf");
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
  return *std::ranges::find(robot->parts, name, &DescribedPart::name);
}

TEST(Hypotheses, FaultsOfOneWeldedPartAreNamed) {
  const RobotDescription right = ReadWeldedRobot();
  RobotDescription fused = right;  // the other file may have one body in the place of the parts
  fused.parts.clear();
  const auto of_the_list = [](const char* name) {
    return [name](DescribedPart& part) {
      StatedLink link{part.body, part.X_iL};
      FindConventionFault(name).make(&link);
      part.body = link.body;
    };
  };
  const auto rotation = [](DescribedPart& part, const Matrix3d& R) { part.X_iL.linear() = R; };
  const struct {
    std::string id;
    std::function<void(DescribedPart&)> make;
    bool of_place = false;
  } kCases[] = {
      {"inertia.about_origin", of_the_list("inertia as if given about the link's origin")},
      {"inertia.carrier_origin",
       [](DescribedPart& part) {
         MassProperties in_link = ExpressIn(part.body, part.X_iL);
         in_link.inertia += CalcOffset(in_link);
         part.body = ExpressIn(in_link, part.X_iL.inverse());
       }},
      {"mass.g", of_the_list("mass as if in g")},
      {"mass.doubled", of_the_list("mass doubled")},
      {"inertia.kg_mm2", of_the_list("inertia as if in kg mm^2")},
      {"com.mm", of_the_list("centre as if in mm")},
      {"com.parent_frame", of_the_list("centre as if given in the parent's frame")},
      {"place.missing", [](DescribedPart& part) { part.X_iL.setIdentity(); }, true},
      {"rotation.missing", [&](DescribedPart& part) { rotation(part, Matrix3d::Identity()); }, true},
      {"rotation.transposed",
       [&](DescribedPart& part) { rotation(part, Matrix3d(part.X_iL.linear().transpose())); }, true},
      {"origin.missing", [](DescribedPart& part) { part.X_iL.translation().setZero(); }, true}};
  // A part is placed in frame i; its weld stands in the link's own frame.
  for (const auto& one : kCases) {
    RobotDescription wrong = right;
    DescribedPart& part = FindPart("FR_foot", &wrong);
    const Pose X_iL = FindPart("FR_calf", &wrong).X_iL;
    part.X_iL = X_iL.inverse() * part.X_iL;
    one.make(part);
    part.X_iL = X_iL * part.X_iL;
    CombineParts(&wrong);
    for (const RobotDescription* const other : {&right, one.of_place ? &right : &fused}) {
      const std::vector<Hypothesis> found = ExplainDifference(wrong, *other);
      ASSERT_EQ(found.size(), 1U) << one.id << "\n" << List(found);
      EXPECT_TRUE(Names(found[0], one.id)) << one.id << "\n" << List(found);
      EXPECT_EQ(found[0].parts, std::vector<std::string>{"FR_calf"});
      EXPECT_THAT(found[0].text, HasSubstr(R"(its part "FR_foot")"));
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
  EXPECT_EQ(Say(wrong, floating),
            "all inertias look as if given about the link's origin instead of the centre of mass: 13 of 13 "
            "links\n");
}

TEST(Hypotheses, NothingIsSaidOfOtherNumbersOfAPart) {
  const RobotDescription right = ReadWeldedRobot();
  RobotDescription wrong = right;
  ChangeNumbers(&FindPart("FR_foot", &wrong).body);
  CombineParts(&wrong);
  EXPECT_EQ(Say(wrong, right), "");
}

/// What a person may have done to a joint.
struct JointFaultCase {
  std::string name;
  std::string id;
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
  for (const RobotPair& pair : ListRobotPairs()) {
    for (const size_t i : {size_t{1}, size_t{3}}) {
      RobotDescription wrong = pair.a;
      GetParam().make(i, &wrong);
      if (wrong.spec.joints[i].type != JointType::kRevolute) continue;
      const std::vector<Hypothesis> found = ExplainDifference(wrong, pair.b);
      if (found.empty() && wrong.spec.joints[i].X_PB.isApprox(pair.a.spec.joints[i].X_PB)) continue;
      ASSERT_EQ(found.size(), 1U) << pair.name << " " << i << "\n" << List(found);
      EXPECT_EQ(found[0].parts, std::vector<std::string>{wrong.spec.joints[i].name}) << List(found);
      EXPECT_NEAR(found[0].explained, 1.0, 1e-12);
      named += Names(found[0], GetParam().id) ? 1 : 0;
    }
  }
  EXPECT_GE(named, 3);
}

/// The fault of the list, at one link.
std::function<void(size_t, RobotDescription*)> OfTheList(const char* name) {
  return [name](size_t i, RobotDescription* robot) { SpoilLink(FindConventionFault(name), i, robot); };
}

INSTANTIATE_TEST_SUITE_P(
    Hypotheses, JointFaults,
    ::testing::Values(JointFaultCase{"Zero", "zero.offset",
                                     [](size_t i, RobotDescription* robot) {
                                       robot->spec.joints[i].mdh.q += DegToRad(30.0);
                                     }},
                      JointFaultCase{"Sign", "axis.sign", TurnAxisAround},
                      JointFaultCase{"Millimetres", "origin.mm", OfTheList("joint as if in mm")},
                      JointFaultCase{"OriginSign", "origin.sign", OfTheList("joint turned around")}),
    [](const auto& named) { return named.param.name; });

TEST(Hypotheses, GravityAndUnitsOfJoints) {
  RobotDescription table = ReadDescription(SourcePath("/controller/parameters/panda.toml"));
  const RobotDescription mjcf = ReadDescription(SourcePath("/mjcf/panda.xml"));
  EXPECT_EQ(Say(table, mjcf), "");
  RobotDescription wrong = table;
  wrong.spec.gravity *= -1.0;
  EXPECT_EQ(Say(wrong, mjcf), "gravity looks turned around (its sign)\n");
  wrong.spec.gravity = Vector3d(0.0, 0.0, -9.8);
  EXPECT_EQ(Say(wrong, mjcf), "gravity has the right direction and another value\n");
  wrong.spec.gravity = Vector3d(0.0, -9.81, 0.0);
  EXPECT_EQ(Say(wrong, mjcf), "gravity points along another axis\n");
  const auto in_degrees = [](Joint& joint) {
    joint.lower = RadToDeg(joint.lower);
    joint.upper = RadToDeg(joint.upper);
  };
  EXPECT_EQ(SayOfJoints(table, mjcf, in_degrees), "all ranges look as if in degrees: 7 of 7 joints\n");
}

// Tables of the Panda that were read by another convention.
TEST(Hypotheses, TablesThatAreMisread) {
  const RobotDescription right = ReadDescription(SourcePath("/controller/parameters/panda.toml"));
  const RobotDescription mjcf = ReadDescription(SourcePath("/mjcf/panda.xml"));
  EXPECT_EQ(SayOfJoints(right, mjcf, [](Joint& joint) { joint.mdh.alpha = RadToDeg(joint.mdh.alpha); }),
            "alpha and q of the rows look as if in degrees: 7 of 7 joints\n");
  const auto in_millimetres = [](Joint& joint) {
    joint.mdh.a *= 1e3;
    joint.mdh.d *= 1e3;
  };
  EXPECT_EQ(SayOfJoints(right, mjcf, in_millimetres),
            "a and d of the rows look as if in mm: 7 of 7 joints\n");
  EXPECT_EQ(SayOfJoints(right, mjcf, [](Joint& joint) { joint.mdh.alpha *= -1.0; }),
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
  EXPECT_EQ(Say(classic, mjcf),
            "the rows look like classic (standard) Denavit-Hartenberg parameters, and are read as modified "
            "ones: 7 of 7 joints\n");
}

}  // namespace
}  // namespace dexcheck::testing::hypotheses_test
