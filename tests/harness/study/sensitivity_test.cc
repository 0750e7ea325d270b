// Points of studies: even coverage, and the same on every machine. Which key matters: functions whose effects
// are known, through the study's own points and rows.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <set>

#include "harness/study/sampling.h"
#include "harness/study/study_findings.h"
#include "tests/harness/study/study_fixture.h"

namespace dexcheck::testing::sensitivity_test {
namespace {

/// Whether each of the `count` equal slices of an axis holds exactly one of the points.
bool FillsSlices(const std::vector<UnitPoint>& points, size_t axis) {
  std::set<long> slices;
  for (const UnitPoint& point : points) {
    if (point[axis] < 0.0 || point[axis] >= 1.0) return false;
    slices.insert(static_cast<long>(point[axis] * static_cast<double>(points.size())));
  }
  return slices.size() == points.size();
}

TEST(Sampling, LatinHypercubeFillsEverySliceOfEveryAxis) {
  const std::vector<UnitPoint> points = MakeLatinHypercube(5, 37, 3);
  ASSERT_EQ(points.size(), 37u);
  for (size_t axis = 0; axis < 5; ++axis) EXPECT_TRUE(FillsSlices(points, axis)) << axis;
  EXPECT_EQ(points, MakeLatinHypercube(5, 37, 3));
  EXPECT_NE(points, MakeLatinHypercube(5, 37, 4));
}

// Owen's scrambling moves every point and keeps what makes the sequence even.
TEST(Sampling, ScrambledSobolFillsEverySliceAndDependsOnItsSeed) {
  const std::vector<UnitPoint> points = MakeSobol(kMaxSobolDimensions, 1024, 5);
  for (size_t axis = 0; axis < kMaxSobolDimensions; ++axis) EXPECT_TRUE(FillsSlices(points, axis)) << axis;
  EXPECT_EQ(points, MakeSobol(kMaxSobolDimensions, 1024, 5));
  EXPECT_NE(points, MakeSobol(kMaxSobolDimensions, 1024, 6));
  std::set<std::pair<long, long>> boxes;
  for (const UnitPoint& point : points) {
    boxes.emplace(static_cast<long>(point[0] * 32.0), static_cast<long>(point[1] * 32.0));
  }
  EXPECT_EQ(boxes.size(), points.size()) << "each dyadic box holds one";
  // The mean of the product of all keys' tents, 1 by construction: even points are far nearer than random
  // ones.
  const auto mean = [](const std::vector<UnitPoint>& at) {
    double sum = 0.0;
    for (const UnitPoint& point : at) {
      double product = 1.0;
      for (size_t i = 0; i < 8; ++i) product *= (2.0 * std::abs(2.0 * point[i] - 1.0) + 1.0) / 2.0;
      sum += product;
    }
    return sum / static_cast<double>(at.size());
  };
  constexpr double kEven = 0.004;  // measured 0.0012; random points of this number scatter by 0.02
  EXPECT_NEAR(mean(points), 1.0, kEven);
}

// Worked by hand from v = 1/2, 1/4 and v = 1/2, 3/4 in Gray code's order.
TEST(Sampling, SobolsFirstPoints) {
  const std::vector<UnitPoint> expected = {{0, 0}, {0.5, 0.5}, {0.75, 0.25}, {0.25, 0.75}};
  EXPECT_EQ(MakeSobol(2, 4), expected);
}

/// A study of `keys` keys from 0 to 1, whose metric `energy` is a function of them.
Study MakeStudy(const std::string& sample, size_t keys, const std::string& more = "") {
  std::string text =
      more + "\nname = \"s\"\nscenario = \"hold\"\nmetrics = [\"energy\"]\n[sample]\n" + sample + "\n";
  for (size_t i = 0; i < keys; ++i) {
    text += "[[vary]]\nkey = \"x" + std::to_string(i + 1) + "\"\nfrom = 0\nto = 1\n";
  }
  return ParseStudy(text, "study.toml");
}

std::vector<TrialRow> MakeRows(const Study& study,
                               const std::function<double(const std::vector<double>&)>& function) {
  std::vector<TrialRow> rows;
  for (const Trial& trial : ListTrials(study)) {
    rows.push_back(MakeTrialRow(trial));
    rows.back().result.metrics[kEnergy] = function(trial.parameters);
  }
  return rows;
}

TEST(MorrisEffects, LeaveOutWhatHasNoValueAndFindNothingInAConstant) {
  const Study study = MakeStudy("method = \"morris\"\ncount = 100", 2);
  std::vector<TrialRow> rows = MakeRows(study, [](const std::vector<double>& x) { return x[0]; });
  for (size_t i = 0; i < rows.size(); i += 97) rows[i].result.outcome = Outcome::kLostContact;
  const Sensitivity some = AnalyseSensitivity(study, rows, "energy");
  ASSERT_EQ(some.effects.size(), 2U);
  constexpr double kRounding = 1e-12;
  EXPECT_NEAR(some.effects[0].size.value, 1.0, kRounding);
  EXPECT_EQ(some.effects[1].size.value, 0.0);
  EXPECT_EQ(some.left_out, 4);
  const auto constant = MakeRows(study, [](const std::vector<double>&) { return 3.0; });
  for (const MorrisEffect& effect : AnalyseSensitivity(study, constant, "energy").effects)
    EXPECT_EQ(effect.size.high, 0.0);
  // When nothing was held, nothing is said.
  for (TrialRow& row : rows) row.result.outcome = Outcome::kRefused;
  EXPECT_EQ(Describe(study, AnalyseSensitivity(study, rows, "energy")),
            "energy does not vary, or too few trials were held.");
}

TEST(MorrisEffects, TellLinearInteractingAndIdleKeysApart) {
  const Study study = MakeStudy("method = \"morris\"\ncount = 20\nseed = 2", 4);
  EXPECT_EQ(CountTrials(study), 20 * 5);
  const auto rows =
      MakeRows(study, [](const std::vector<double>& x) { return 3.0 * x[0] - x[1] + 4.0 * x[1] * x[2]; });
  const std::vector<MorrisEffect> effects = AnalyseSensitivity(study, rows, "energy").effects;
  ASSERT_EQ(effects.size(), 4U);
  constexpr double kRounding = 1e-12;
  EXPECT_NEAR(effects[0].size.value, 3.0, kRounding);
  EXPECT_NEAR(effects[0].mean, 3.0, kRounding);
  EXPECT_NEAR(effects[0].spread, 0.0, kRounding);
  EXPECT_GT(effects[1].spread, 0.5) << "its effect depends on x3";
  EXPECT_GT(effects[2].size.low, 0.5);
  EXPECT_NEAR(effects[3].size.value, 0.0, kRounding);
}

// Tables of Clopper and Pearson's interval: 0 of 10, 1 of 20, 10 of 10.
TEST(Probability, HasClopperAndPearsonsInterval) {
  constexpr double kPrinted = 5e-5;
  EXPECT_EQ(CalcProbability(0, 10).low, 0.0);
  EXPECT_NEAR(CalcProbability(0, 10).high, 0.3085, kPrinted);
  EXPECT_NEAR(CalcProbability(1, 20).low, 0.0013, kPrinted);
  EXPECT_NEAR(CalcProbability(1, 20).high, 0.2487, kPrinted);
  EXPECT_NEAR(CalcProbability(10, 10).low, 0.6915, kPrinted);
  EXPECT_EQ(CalcProbability(10, 10).high, 1.0);
}

TEST(Probability, IsMeasuredOfASampleWithConstraints) {
  const Study study =
      MakeStudy("method = \"random\"\ncount = 1000\nseed = 1", 2, "constraints = [\"energy < 0.9\"]");
  const auto rows = MakeRows(study, [](const std::vector<double>& x) { return x[0]; });
  long failures = 0;
  for (const TrialRow& row : rows) failures += row.result.metrics[kEnergy] > 0.9 ? 1 : 0;
  const Estimate estimate = CalcProbability(failures, 1000);
  EXPECT_LT(estimate.low, 0.1);
  EXPECT_GT(estimate.high, 0.1);
  const std::vector<std::string> answers = ListFindings(study, rows);
  ASSERT_FALSE(answers.empty());
  EXPECT_NE(answers[0].find(std::to_string(failures) + " of 1000 trials"), std::string::npos) << answers[0];
}

}  // namespace
}  // namespace dexcheck::testing::sensitivity_test
