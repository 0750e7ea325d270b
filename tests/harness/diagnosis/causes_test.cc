// How causes are worded, and how what is named compares with what was wrong.

#include "harness/diagnosis/causes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "harness/diagnosis/force_telling.h"
#include "harness/injection/drawn_faults.h"
#include "tests/common/matchers.h"
#include "tests/common/paper_robot.h"

namespace dexcheck::testing::causes_test {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Fault MakeGain(double value = 0.99, double error = 0.001) {
  return {"gain", "motor r_elbow", value, error, "", ""};
}

Fault MakeOffset(double value = -0.05, double error = 0.0) {
  return {"offset", "motor r_elbow", value, error, "N m", ""};
}

Explanation MakeExplanation(std::vector<Fault> faults) {
  Explanation one;
  one.faults = std::move(faults);
  one.from = 0.25;
  one.to = 1.5;
  one.SetOutcome();
  return one;
}

Explanation MakeNotExplained(std::vector<Fault> nearest) {
  Explanation one = MakeExplanation(std::move(nearest));
  one.outcome = CauseOutcome::kNotExplained;
  one.fraction = 0.5;
  one.left = 40.0;
  return one;
}

// Each with its size, unit, detail, time and what else may be; golden files have whole lines.
TEST(ExplanationTest, IsToldInALine) {
  const Fault ripple = {"ripple", "motor r_elbow", 0.061234567, 0.00123456, "N m", "at 41.3 Hz"};
  EXPECT_EQ(ripple.Describe(), "motor r_elbow: ripple 0.0612 +- 0.0012 N m at 41.3 Hz");
  Explanation one = MakeExplanation({MakeGain()});
  EXPECT_THAT(one.Describe(), EndsWith("from 0.25 s"));
  one.ends = true;
  one.rival = "delay";
  one.log_odds = 4.605;  // log(1e2)
  EXPECT_THAT(one.Describe(), EndsWith("0.25 to 1.5 s; 100 times less likely: delay"));
  std::vector<Fault> faults = {MakeGain(), MakeOffset()};
  for (const char* name : {"drift", "lag", "delay", "limit"})
    faults.push_back({name, "motor r_elbow", 1.0, 0.0, "", ""});
  EXPECT_THAT(MakeExplanation(faults).Describe(),
              AllOf(HasSubstr("lag 1 or 2 more (this motion"), Not(HasSubstr("delay"))));
  EXPECT_THAT(MakeNotExplained({MakeOffset()}).Describe(),
              AllOf(StartsWith("not explained; nearest: motor r_elbow: offset"), HasSubstr("50 %")));
}

// Gravity of another size along itself has one amplitude, and the name of one that points elsewhere.
TEST(ForceFaultTest, SizeOfGravityIsGravity) {
  const Candidate candidate{.fault = force_fault::kGravitySize, .place = "world", .unit = "m/s^2"};
  const Fault fault =
      MakeForceFault(candidate, VectorXd::Constant(1, -0.3), VectorXd::Constant(1, 0.01), ReadPanda());
  EXPECT_EQ(fault.Describe(), "world: gravity off by 0.3 +- 0.01 m/s^2 (0, 0, 0.3)");
}

TEST(ForceFaultTest, VectorsAreInTheAxesOfTheLinksFile) {
  RobotSpec robot = ReadPanda().spec();
  robot.joints[2].R_iL = Eigen::AngleAxisd(0.5 * kPi, Vector3d::UnitX()).toRotationMatrix();
  const std::string place = "link " + robot.joints[2].link;
  const auto describe = [&](const char* fault, const VectorXd& a) {
    return MakeForceFault({.fault = fault, .place = place}, a, {}, RobotModel(robot)).detail;
  };
  EXPECT_EQ(describe(force_fault::kCenterAlone, Vector3d(0.0, 0.0, 0.01)), "(0, 0.01, 0)");
  EXPECT_EQ(describe("inertia", Vector6d::Unit(2)), "(0, 1, 0, 0, 0, 0)");
  EXPECT_EQ(describe(force_fault::kForce, Vector3d(0.0, 0.0, 1.0)), "(0, 0, 1)") << "in world axes";
}

TEST(ExplanationTest, SameKindAndPlaceIsOneName) {
  const Explanation one = MakeExplanation({MakeGain(0.99), MakeGain(0.98), MakeGain(0.97)});
  EXPECT_EQ(one.outcome, CauseOutcome::kNamed);
  ASSERT_EQ(one.faults.size(), 1u);
  EXPECT_EQ(one.faults.front().value, 0.99);  // the most likely
  const Explanation two = MakeExplanation({MakeGain(0.99), MakeOffset(), MakeGain(0.98), MakeOffset(0.1)});
  EXPECT_EQ(two.outcome, CauseOutcome::kNamedClass);
  ASSERT_EQ(two.faults.size(), 2u);
  EXPECT_TRUE(two.faults[0].IsLike(MakeGain()));
  EXPECT_TRUE(two.faults[1].IsLike(MakeOffset()));
  EXPECT_EQ(two.faults[1].value, MakeOffset().value);
}

TEST(CausesTest, NamesIsOfTheFirstFaultOfWhatIsExplained) {
  const Causes causes = {MakeExplanation({MakeGain(), MakeOffset()}),
                         MakeNotExplained({{"lag", "", 0, 0, "", ""}}), MakeNotExplained({})};
  EXPECT_TRUE(Names(causes, "gain"));
  EXPECT_FALSE(Names(causes, "offset"));  // its second
  EXPECT_FALSE(Names(causes, "lag"));     // the nearest of what is not explained
  EXPECT_FALSE(Names({}, "gain"));
}

/// A gain of 0.9: its error is the change, so that 5 % of it are 0.005.
std::vector<Fault> MakeTruth() { return {MakeGain(0.9, 0.1)}; }

/// Right, in a class, not explained, wrong.
::testing::Matcher<NamingScore> IsScore(int right, int in_class, int not_explained, int wrong) {
  return AllOf(Field("right", &NamingScore::right, right),
               Field("in_class", &NamingScore::in_class, in_class),
               Field("not_explained", &NamingScore::not_explained, not_explained),
               Field("wrong", &NamingScore::wrong, wrong));
}

NamingScore Score(const Causes& causes) { return ScoreNames(MakeTruth(), MakeTruth(), causes); }

TEST(ScoreNamesTest, CountsNamesOfOneFault) {
  const Fault drift = {"drift", "motor r_elbow", 1.0, 0.0, "N m/s", ""};
  Fault elsewhere = MakeGain(0.9);
  elsewhere.place = "motor l_elbow";
  const auto one = [](const Fault& fault) { return Causes{MakeExplanation({fault})}; };
  // A name is right within a fraction of the change, or within standard errors.
  EXPECT_THAT(Score(one(MakeGain(0.904, 0.0))), IsScore(1, 0, 0, 0));
  EXPECT_THAT(Score(one(MakeGain(0.906, 0.0))), IsScore(0, 0, 1, 1));
  EXPECT_THAT(Score(one(MakeGain(0.929, 0.01))), IsScore(1, 0, 0, 0));
  EXPECT_THAT(Score(one(MakeGain(0.931, 0.01))), IsScore(0, 0, 1, 1));
  // A class has the fault at any place, and so has a size that the motion does not show.
  EXPECT_THAT(Score({MakeExplanation({MakeOffset(), MakeGain(0.9)})}), IsScore(0, 1, 0, 0));
  EXPECT_THAT(Score({MakeExplanation({MakeGain(0.9), MakeOffset()})}), IsScore(0, 1, 0, 0));
  EXPECT_THAT(Score(one(MakeGain(0.3, kInfinity))), IsScore(0, 1, 0, 0));
  // A class without it is no name of it, and nothing wrong either; the nearest names nothing.
  EXPECT_THAT(Score({MakeExplanation({drift, MakeOffset()})}), IsScore(0, 0, 1, 0));
  EXPECT_THAT(Score({}), IsScore(0, 0, 1, 0));
  EXPECT_THAT(Score({MakeNotExplained({MakeGain(0.9)})}), IsScore(0, 0, 1, 0));
  EXPECT_THAT(Score({MakeNotExplained({})}), IsScore(0, 0, 1, 0));
  EXPECT_THAT(Score({MakeExplanation({MakeGain(0.9)}), MakeExplanation({MakeOffset()})}),
              IsScore(1, 0, 0, 1));
  EXPECT_THAT(Score(one(elsewhere)), IsScore(0, 0, 1, 1));
}

TEST(ScoreNamesTest, FaultThatIsTooSmallAloneMayBeNamed) {
  const Fault small = MakeOffset(0.001, 0.001);
  const std::vector<Fault> truth = MakeTruth(), all = {truth.front(), small};
  const Explanation named = MakeExplanation({MakeGain(0.9)});
  EXPECT_THAT(ScoreNames(truth, all, {named, MakeExplanation({small})}), IsScore(1, 0, 0, 0));
  EXPECT_THAT(ScoreNames(truth, all, {named}), IsScore(1, 0, 0, 0));
  // With its own value, that is.
  EXPECT_THAT(ScoreNames(truth, all, {named, MakeExplanation({MakeOffset(0.002)})}), IsScore(1, 0, 0, 1));
}

TEST(ScoreNamesTest, OneOfThoseThatAllHaveMayHaveItsOwnBesides) {
  const Fault all = {"gain", "all motors", 0.99, 0.01, "", ""};
  const std::vector<Fault> truth = {all, MakeGain(0.9, 0.1)};
  const Explanation common = MakeExplanation({all});
  EXPECT_THAT(ScoreNames(truth, truth, {common, MakeExplanation({MakeGain(0.9)})}), IsScore(2, 0, 0, 0));
  // Named by itself, one that all have is not wrong; neither value is.
  EXPECT_THAT(ScoreNames(truth, truth, {common, MakeExplanation({MakeGain(0.8)})}), IsScore(1, 0, 1, 1));
}

TEST(ScoreNamesTest, EachOfSeveralFaultsCounts) {
  const Fault delay = {"delay", "motor l_elbow", 3.0, 3.0, "steps", ""};
  const Fault drift = {"drift", "motor r_hip", 0.3, 0.3, "N m/s", ""};
  const std::vector<Fault> truth = {MakeGain(0.9, 0.1), delay, drift};
  EXPECT_THAT(ScoreNames(truth, truth,
                         {MakeExplanation({MakeGain(0.9)}), MakeExplanation({MakeOffset(), delay}),
                          MakeNotExplained({drift})}),
              IsScore(1, 1, 1, 0));
  EXPECT_THAT(ScoreNames({}, {}, {}), IsScore(0, 0, 0, 0));
}

}  // namespace
}  // namespace dexcheck::testing::causes_test
