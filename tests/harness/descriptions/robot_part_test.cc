// Part of a robot: a held joint against the whole robot's terms, what is left out, and what two have in
// common.

#include "harness/descriptions/robot_part.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "controller/common/errors.h"
#include "controller/dynamics/model_terms.h"
#include "tests/common/matrix_near.h"
#include "tests/harness/descriptions/robot_pairs.h"

namespace dexcheck::testing::robot_part_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

RobotDescription Panda() { return ListRobotPairs().front().a; }

std::string JointName(const RobotDescription& robot, size_t i) { return robot.spec.joints[i].name; }

// With q_k = v and its rate zero, the other joints' terms are those of the robot whose joint k is welded at
// v.
TEST(RobotPart, AHeldJointLeavesTheOthersTheirTerms) {
  constexpr double kHeldAt = 0.7;
  const RobotDescription whole = Panda();
  const RobotModel model(whole.spec);
  const int n = model.num_velocities();
  for (int k = 0; k < n; ++k) {
    SCOPED_TRACE(k);
    RobotDescription a = whole;
    RobotDescription b = whole;
    RobotPart part;
    part.held[JointName(whole, static_cast<size_t>(k))] = kHeldAt;
    int held = 0;
    TakePart(part, &a, &b, &held);
    EXPECT_EQ(held, 2);
    const RobotModel reduced(a.spec);
    ASSERT_EQ(reduced.num_velocities(), n - 1);
    std::vector<int> kept(static_cast<size_t>(n));
    std::iota(kept.begin(), kept.end(), 0);
    kept.erase(kept.begin() + k);
    VectorXd q = VectorXd::LinSpaced(n, -0.9, 1.1);
    VectorXd xi = VectorXd::LinSpaced(n, 0.5, -1.3);
    q[k] = kHeldAt;
    xi[k] = 0.0;
    ModelTerms terms(model);
    terms.SetState(q, xi);
    terms.CalcDynamics();
    ModelTerms reduced_terms(reduced);
    reduced_terms.SetState(q(kept), xi(kept));
    reduced_terms.CalcDynamics();
    constexpr double kRounding = 1e-13;  // of numbers of size 10, summed over seven bodies
    ASSERT_GT(reduced_terms.M().norm(), 0.1);
    EXPECT_TRUE(MatrixNear(reduced_terms.M(), terms.M()(kept, kept), kRounding));
    EXPECT_TRUE(MatrixNear(reduced_terms.gravity(), terms.gravity()(kept), kRounding));
    EXPECT_TRUE(MatrixNear(reduced_terms.C() * xi(kept), (terms.C() * xi)(kept), kRounding));
  }
}

TEST(RobotPart, OfASubtreeHoldsTheRest) {
  RobotDescription a = Panda();
  RobotDescription b = Panda();
  const std::string joint = JointName(a, 4);
  const double mass = a.spec.joints[4].body.mass;
  RobotPart part;
  part.only = joint;
  int held = 0;
  TakePart(part, &a, &b, &held);
  EXPECT_EQ(held, 8);
  ASSERT_EQ(a.spec.joints.size(), 3U);
  EXPECT_EQ(a.spec.joints[0].name, joint);
  EXPECT_EQ(a.spec.joints[0].parent, -1);
  EXPECT_EQ(a.spec.joints[0].body.mass, mass);
}

TEST(RobotPart, ALinkIsLeftOutWithWhatItCarries) {
  RobotDescription a = Panda();
  RobotDescription b = Panda();
  RobotPart part;
  part.left_out = {a.spec.joints[5].link};
  int held = 0;
  EXPECT_THAT(TakePart(part, &a, &b, &held).back(), HasSubstr(part.left_out[0]));
  EXPECT_EQ(a.spec.joints.size(), 5U);
  EXPECT_EQ(a.spec.joints[4].body.mass, Panda().spec.joints[4].body.mass);
  for (const Frame& frame : a.spec.frames) EXPECT_LT(frame.link, 5);
}

TEST(RobotPart, NamesThatAreNotThereAreRefused) {
  for (const auto& change :
       {+[](RobotPart* part) { part->held["no"] = 0.0; }, +[](RobotPart* part) { part->only = "no"; },
        +[](RobotPart* part) { part->left_out = {"no"}; }}) {
    RobotDescription a = Panda();
    RobotDescription b = Panda();
    RobotPart part;
    change(&part);
    int held = 0;
    EXPECT_THROW(TakePart(part, &a, &b, &held), InputError);
  }
  RobotPart part;
  AddHeldJoint("elbow=0.5", &part);
  AddHeldJoint("wrist", &part);
  EXPECT_EQ(part.held, (std::map<std::string, double>{{"elbow", 0.5}, {"wrist", 0.0}}));
  for (const char* text : {"elbow=", "elbow=x", "elbow=nan"})
    EXPECT_THROW(AddHeldJoint(text, &part), InputError);
}

}  // namespace
}  // namespace dexcheck::testing::robot_part_test
