// Objectives and constraints, judged over the trials of a point.

#include "harness/study/objective.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "tests/common/throws.h"

namespace dexcheck::testing::objective_test {
namespace {

constexpr double kRounding = 1e-15;  // of sums and quotients of a few numbers near 1

TrialResult MakeResult(double energy, double effort, Outcome outcome = Outcome::kTracked) {
  TrialResult result;
  result.outcome = outcome;
  result.metrics.fill(1.0);
  result.metrics[kEnergy] = energy;
  result.metrics[kPeakEffort] = effort;
  return result;
}

Objective MakeObjective(const std::string& expression, Aggregate aggregate, double quantile = 0.5) {
  return {expression, false, aggregate, quantile};
}

double Judge(const Objective& objective, const std::vector<TrialResult>& results) {
  return JudgePoint({objective}, {}, results).objectives.front();
}

TEST(Objective, AggregatesOverTheTrialsOfAPoint) {
  const std::vector<TrialResult> results = {MakeResult(4, 0), MakeResult(1, 0), MakeResult(2, 0),
                                            MakeResult(3, 0)};
  EXPECT_EQ(Judge(MakeObjective("energy", Aggregate::kMean), results), 2.5);
  EXPECT_EQ(Judge(MakeObjective("energy", Aggregate::kWorst), results), 4.0);
  EXPECT_EQ(Judge(MakeObjective("energy", Aggregate::kQuantile, 0.5), results), 2.0);
  EXPECT_EQ(Judge(MakeObjective("energy", Aggregate::kQuantile, 0.51), results), 3.0);
  EXPECT_EQ(Judge(MakeObjective("energy", Aggregate::kQuantile, 1.0), results), 4.0);
  // A metric to maximise is minimised with the other sign: its worst is the least.
  Objective maximize = MakeObjective("energy", Aggregate::kWorst);
  maximize.maximize = true;
  EXPECT_EQ(Judge(maximize, results), -1.0);
}

TEST(Objective, IsAnExpressionOfMetrics) {
  EXPECT_EQ(Judge(MakeObjective("energy / 2 + 10 * peak_effort", Aggregate::kMean), {MakeResult(3, 0.25)}),
            4.0);
  EXPECT_NO_THROW(RequireMetricExpression("2 * (energy - overshoot)"));
  EXPECT_TRUE(Throws<std::invalid_argument>([] { return RequireMetricExpression("energi"), 0; }, "energi"));
  EXPECT_TRUE(Throws<std::invalid_argument>([] { return RequireMetricExpression("energy +"), 0; }, ""));
}

TEST(Objective, AValueThatDoesNotExistIsNeverTheBest) {
  const Judgement nan =
      JudgePoint({MakeObjective("energy", Aggregate::kMean)}, {}, std::vector{MakeResult(std::nan(""), 0)});
  EXPECT_FALSE(nan.is_feasible());
  const Judgement good =
      JudgePoint({MakeObjective("energy", Aggregate::kMean)}, {}, std::vector{MakeResult(1e9, 0)});
  EXPECT_TRUE(IsBetter(good, nan));
  EXPECT_FALSE(IsBetter(nan, good));
}

TEST(Constraint, ComparesMetricsOutcomesAndVerdicts) {
  const TrialResult good = MakeResult(1, 0.5);
  const TrialResult slipped = MakeResult(1, 0.5, Outcome::kSlipped);
  const auto violation = [](const std::string& text, const TrialResult& result) {
    return CalcViolation(ParseConstraint(text), result);
  };
  EXPECT_EQ(violation("peak_effort < 0.8", good), 0.0);
  EXPECT_NEAR(violation("peak_effort < 0.4", good), 0.2, kRounding);
  EXPECT_NEAR(violation("0.4 >= peak_effort", good), 0.2, kRounding);
  EXPECT_NEAR(violation("peak_effort > 2 * energy", good), 0.75, kRounding);
  EXPECT_EQ(violation("outcome == tracked", good), 0.0);
  EXPECT_EQ(violation("outcome == tracked", slipped), 1.0);
  EXPECT_EQ(violation("outcome != slipped", slipped), 1.0);
  EXPECT_EQ(violation("outcome != wheels spun", slipped), 0.0);
  EXPECT_EQ(violation("verdict == pass", good), 0.0);
  EXPECT_EQ(violation("verdict == pass", slipped), 1.0);
  EXPECT_EQ(violation("held", slipped), 0.0);
  for (const auto& [text, problem] : {std::pair{"peak_effort", "must be a comparison"},
                                      {"effort < 1", "effort"},
                                      {"outcome == tracke", "did you mean \"tracked\"?"},
                                      {"energy == 3", "compares \"outcome\""},
                                      {"verdict == fail", "compares \"outcome\""}}) {
    EXPECT_TRUE(Throws<std::invalid_argument>([t = text] { return ParseConstraint(t); }, problem)) << text;
  }
}

TEST(Constraint, WhatIsNotHeldIsWorseTheEarlierItEnded) {
  TrialResult early = MakeResult(1, 0.5, Outcome::kLostContact);
  TrialResult late = early;
  early.metrics[kSimulatedTime] = 0.1;
  late.metrics[kSimulatedTime] = 2.0;
  const Constraint constraint = ParseConstraint("peak_effort < 0.8");
  EXPECT_GT(CalcViolation(constraint, early), CalcViolation(constraint, late));
  EXPECT_GT(CalcViolation(constraint, late), CalcViolation(constraint, MakeResult(1, 1e9)))
      << "held, but too strong";
}

TEST(Constraint, AShareOfTheTrialsMayBeEnough) {
  std::vector<TrialResult> results(9, MakeResult(1, 0.5));
  results.push_back(MakeResult(1, 0.9));
  Constraint constraint = ParseConstraint("peak_effort < 0.8");
  EXPECT_FALSE(JudgePoint({}, {constraint}, results).is_feasible());
  constraint.fraction = 0.9;
  EXPECT_TRUE(JudgePoint({}, {constraint}, results).is_feasible());
  constraint.fraction = 0.91;
  EXPECT_FALSE(JudgePoint({}, {constraint}, results).is_feasible());
  // A trial that was lost counts, unless a constraint says how many may be.
  results.back() = MakeResult(1, 0.5, Outcome::kDiverged);
  EXPECT_FALSE(JudgePoint({}, {}, results).is_feasible());
  Constraint held = ParseConstraint("held");
  held.fraction = 0.9;
  EXPECT_TRUE(JudgePoint({}, {held}, results).is_feasible());
}

TEST(Judgement, DominatesWhereItIsNowhereWorse) {
  EXPECT_TRUE(Dominates({{1, 2}, 0}, {{1, 3}, 0}));
  EXPECT_FALSE(Dominates({{1, 2}, 0}, {{1, 2}, 0}));
  EXPECT_FALSE(Dominates({{1, 2}, 0}, {{0, 3}, 0}));
  EXPECT_TRUE(Dominates({{9, 9}, 0}, {{1, 2}, 0.1})) << "one that is not feasible";
  EXPECT_FALSE(Dominates({{1, 2}, 0.1}, {{9, 9}, 0}));
}

}  // namespace
}  // namespace dexcheck::testing::objective_test
