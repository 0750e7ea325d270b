// A robot's tests in somebody else's project: robot_test ROBOT.toml ROBOT.xml

#include <gmock/gmock.h>

#include <string>

#include "controller/dynamics/model_terms.h"
#include "harness/comparison/matchers.h"
#include "harness/descriptions/read_description.h"

namespace {

using ::testing::Not;

std::string ArgumentAt(size_t index) { return ::testing::internal::GetArgvs().at(index); }

/// Code under test: a mass matrix of one's own, here the library's, with armature added to the first joint.
dexcheck::TermFunctions MakeTerms(double armature) {
  dexcheck::RobotDescription robot = dexcheck::ReadDescription(ArgumentAt(1));
  robot.spec.joints[0].armature += armature;
  dexcheck::TermFunctions functions;
  functions.name = "my terms";
  functions.M = [model = std::make_shared<dexcheck::RobotModel>(robot.spec)](const Eigen::VectorXd& q) {
    dexcheck::ModelTerms terms(*model);
    terms.SetState(q, Eigen::VectorXd::Zero(model->num_velocities()));
    terms.CalcDynamics();
    return terms.M();
  };
  return functions;
}

TEST(Robot, FilesAgree) { EXPECT_THAT(ArgumentAt(1), dexcheck::testing::AgreesWith(ArgumentAt(2))); }

TEST(Robot, CodeAgrees) {
  EXPECT_THAT(MakeTerms(0.0), dexcheck::testing::AgreesWith(ArgumentAt(2), {.samples = 50}));
  EXPECT_THAT(MakeTerms(1e-6), dexcheck::testing::AgreesWith(ArgumentAt(2), {.samples = 50, .digits = 4}));
}

TEST(Robot, AFaultIsReported) {
  EXPECT_THAT(MakeTerms(0.1), Not(dexcheck::testing::AgreesWith(ArgumentAt(2), {.samples = 50})));
  ::testing::StringMatchResultListener listener;
  EXPECT_FALSE(::testing::ExplainMatchResult(dexcheck::testing::AgreesWith(ArgumentAt(2), {.samples = 50}),
                                             MakeTerms(0.1), &listener));
  EXPECT_THAT(listener.str(), ::testing::HasSubstr("M_bar: first at "));
}

}  // namespace
