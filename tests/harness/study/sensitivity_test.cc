// Points of studies: even coverage, and the same on every machine. Which key matters: functions whose indices
// are known, through the study's own points and rows.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <set>

#include "harness/study/sampled_stability.h"
#include "harness/study/sampling.h"
#include "harness/study/search.h"
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

/// Ishigami's function of x in [0, 1]^3, scaled to [-pi, pi].
double Ishigami(const std::vector<double>& x) {
  const auto scaled = [&](size_t i) { return M_PI * (2.0 * x[i] - 1.0); };
  const double b = 0.1 * std::pow(scaled(2), 4) * std::sin(scaled(0));
  return std::sin(scaled(0)) + 7.0 * std::pow(std::sin(scaled(1)), 2) + b;
}

struct Index {
  double first, total;
};

/// Indices, and the same with first and total interchanged.
struct Coverage {
  double of_known, of_interchanged;
};

/// Fractions of the intervals, of studies of 1024 blocks with ten seeds, that hold the indices known and the
/// wrong ones.
Coverage CalcCoverage(const std::vector<Index>& known,
                      const std::function<double(const std::vector<double>&)>& function) {
  constexpr int kSeeds = 10;
  constexpr double kWidest = 0.2;  // an interval that holds everything would show nothing
  long covered = 0;
  long wrong = 0;
  const auto holds = [](const Estimate& interval, double value) {
    return interval.low <= value && value <= interval.high ? 1 : 0;
  };
  for (int seed = 0; seed < kSeeds; ++seed) {
    const Study study =
        MakeStudy("method = \"saltelli\"\ncount = 1024\nseed = " + std::to_string(seed), known.size());
    const Sensitivity sensitivity = AnalyseSensitivity(study, MakeRows(study, function), "energy");
    EXPECT_EQ(sensitivity.sobol.size(), known.size());
    for (size_t i = 0; i < sensitivity.sobol.size(); ++i) {
      const SobolIndex& index = sensitivity.sobol[i];
      covered += holds(index.first, known[i].first) + holds(index.total, known[i].total);
      wrong += holds(index.first, known[i].total) + holds(index.total, known[i].first);
      EXPECT_LT(index.first.high - index.first.low, kWidest);
      EXPECT_LT(index.total.high - index.total.low, kWidest);
    }
  }
  const auto intervals = static_cast<double>(2 * kSeeds * known.size());
  return {static_cast<double>(covered) / intervals, static_cast<double>(wrong) / intervals};
}

constexpr double kLeastCoverage = 0.9;  // of intervals of 95 %: 60 and 120 of them scatter by 3 and 2 %

// Closed forms, with V1 = (1 + b pi^4 / 5)^2 / 2, V2 = a^2 / 8, V13 = b^2 pi^8 (1/18 - 1/50), a = 7, b = 0.1.
TEST(SobolIndices, OfIshigamiLieInTheirIntervals) {
  const double pi4 = std::pow(M_PI, 4);
  const double V1 = 0.5 * std::pow(1.0 + 0.1 * pi4 / 5.0, 2);
  const double V2 = 49.0 / 8.0;
  const double V13 = 0.01 * pi4 * pi4 * (1.0 / 18.0 - 1.0 / 50.0);
  const double V = V1 + V2 + V13;
  EXPECT_GE(CalcCoverage({{V1 / V, (V1 + V13) / V}, {V2 / V, V2 / V}, {0.0, V13 / V}}, Ishigami).of_known,
            kLeastCoverage);
}

// Sobol's g-function with a = 0, 1, 4.5, 9, 99, 99: V_i = 1 / (3 (1 + a_i)^2), V = prod(1 + V_i) - 1.
TEST(SobolIndices, OfTheGFunctionLieInTheirIntervals) {
  const std::vector<double> a = {0, 1, 4.5, 9, 99, 99};
  const auto g = [&](const std::vector<double>& x) {
    double product = 1.0;
    for (size_t i = 0; i < a.size(); ++i) product *= (std::abs(4.0 * x[i] - 2.0) + a[i]) / (1.0 + a[i]);
    return product;
  };
  double all = 1.0;
  for (const double ai : a) all *= 1.0 + 1.0 / (3.0 * (1.0 + ai) * (1.0 + ai));
  std::vector<Index> known;
  for (const double ai : a) {
    const double Vi = 1.0 / (3.0 * (1.0 + ai) * (1.0 + ai));
    known.push_back({Vi / (all - 1.0), Vi * all / (1.0 + Vi) / (all - 1.0)});
  }
  const Coverage coverage = CalcCoverage(known, g);
  EXPECT_GE(coverage.of_known, kLeastCoverage);
  EXPECT_LT(coverage.of_interchanged, kLeastCoverage);
}

// The squared error of a step response, J = e0^2 (K_v^2 + K_p) / (2 K_v K_p), the integral of (57)'s solution
// from e0 at rest: with K_p = w^2 and K_v = 2 z w it is e0^2 (4 z^2 + 1) / (4 z w), a product of functions of
// one key each, so that V = prod(1 + v_i) - 1, S_i = v_i / V and ST_i = v_i prod_{j != i}(1 + v_j) / V with
// v_i = Var f_i / (E f_i)^2.
TEST(SobolIndices, OfTheLinearLoopLieInTheirIntervals) {
  constexpr double kError0 = 0.5e-3, kError1 = 1.5e-3;  // m
  constexpr double kSlow = 10.0, kFast = 30.0;          // rad/s
  constexpr double kLoose = 0.5, kStiff = 2.0;          // damping ratios
  const auto relative_variance = [](const std::function<double(double)>& f, double from, double to) {
    constexpr int kSteps = 20000;
    double sum = 0.0;
    double squares = 0.0;
    for (int i = 0; i < kSteps; ++i) {
      const double y = f(from + (i + 0.5) / kSteps * (to - from));
      sum += y / kSteps;
      squares += y * y / kSteps;
    }
    return squares / (sum * sum) - 1.0;
  };
  const std::vector<double> v = {
      relative_variance([](double e0) { return e0 * e0; }, kError0, kError1),
      relative_variance([](double w) { return 1.0 / w; }, kSlow, kFast),
      relative_variance([](double z) { return (4.0 * z * z + 1.0) / z; }, kLoose, kStiff)};
  double all = 1.0;
  for (const double vi : v) all *= 1.0 + vi;
  std::vector<Index> known;
  for (const double vi : v) known.push_back({vi / (all - 1.0), vi * all / (1.0 + vi) / (all - 1.0)});
  // What a trial of `offset` measures, stepped as the plant steps it.
  constexpr double kStep = 1e-3;  // s
  constexpr long kSteps = 1000;
  const auto measured = [&](const std::vector<double>& x) {
    const double e0 = kError0 + x[0] * (kError1 - kError0);
    const double w = kSlow + x[1] * (kFast - kSlow);
    const double z = kLoose + x[2] * (kStiff - kLoose);
    double J = 0.0;
    for (const double e : CalcStepResponse({kStep, 1}, {w * w, 2.0 * z * w}, kSteps))
      J += kStep * e0 * e0 * e * e;
    return J;
  };
  const Coverage coverage = CalcCoverage(known, measured);
  EXPECT_GE(coverage.of_known, kLeastCoverage);
  EXPECT_LT(coverage.of_interchanged, kLeastCoverage);
}

TEST(SobolIndices, LeaveOutWhatHasNoValueAndFindNothingInAConstant) {
  const Study study = MakeStudy("method = \"saltelli\"\ncount = 256", 2);
  std::vector<TrialRow> rows = MakeRows(study, [](const std::vector<double>& x) { return x[0]; });
  for (size_t i = 0; i < rows.size(); i += 97) rows[i].result.outcome = Outcome::kLostContact;
  const Sensitivity some = AnalyseSensitivity(study, rows, "energy");
  ASSERT_EQ(some.sobol.size(), 2U);
  constexpr double kTolerance = 0.1;  // of 253 blocks
  EXPECT_NEAR(some.sobol[0].first.value, 1.0, kTolerance);
  EXPECT_NEAR(some.sobol[1].total.value, 0.0, kTolerance);
  EXPECT_EQ(some.left_out, 11);
  const auto constant = MakeRows(study, [](const std::vector<double>&) { return 3.0; });
  EXPECT_TRUE(AnalyseSensitivity(study, constant, "energy").sobol.empty());
  // Of Morris's walks, too: when nothing was held, nothing is said.
  const Study walks = MakeStudy("method = \"morris\"\ncount = 4", 2);
  std::vector<TrialRow> lost = MakeRows(walks, [](const std::vector<double>& x) { return x[0]; });
  EXPECT_FALSE(AnalyseSensitivity(walks, lost, "energy").empty());
  for (TrialRow& row : lost) row.result.outcome = Outcome::kRefused;
  const Sensitivity nothing = AnalyseSensitivity(walks, lost, "energy");
  EXPECT_EQ(Describe(walks, nothing), "energy does not vary, or too few trials were held.");
}

TEST(MorrisEffects, TellLinearInteractingAndIdleKeysApart) {
  const Study study = MakeStudy("method = \"morris\"\ncount = 20\nseed = 2", 4);
  EXPECT_EQ(CountTrials(study), 20 * 5);
  const auto rows =
      MakeRows(study, [](const std::vector<double>& x) { return 3.0 * x[0] - x[1] + 4.0 * x[1] * x[2]; });
  const std::vector<MorrisEffect> effects = AnalyseSensitivity(study, rows, "energy").morris;
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

/// A ball with radius 0.3 around (0.5, 0.4): the margins are known in every direction.
TEST(Margins, AreFoundByBisection) {
  Search search;
  search.method = SearchMethod::kMargins;
  search.directions = 6;
  search.tolerance = 1e-3;
  const UnitPoint start = {0.6, 0.2};
  MarginSearcher searcher(search, start);
  const auto distance = [](const UnitPoint& x) { return std::hypot(x[0] - 0.5, x[1] - 0.4); };
  long count = 0;
  for (std::vector<UnitPoint> batch = searcher.Ask(); !batch.empty(); batch = searcher.Ask()) {
    std::vector<Judgement> judgements;
    for (const UnitPoint& point : batch) judgements.push_back({{}, distance(point) < 0.3 ? 0.0 : 1.0});
    count += static_cast<long>(batch.size());
    searcher.Tell(judgements);
  }
  EXPECT_LE(count, MarginSearcher::CountPoints(search, 2));
  ASSERT_EQ(searcher.margins().size(), 10U);
  int turned = 0;
  for (const Margin& margin : searcher.margins()) {
    if (margin.bad.empty()) continue;
    ++turned;
    EXPECT_LT(distance(margin.good), 0.3);
    EXPECT_GE(distance(margin.bad), 0.3);
    EXPECT_LE(margin.at_most - margin.distance, search.tolerance);
  }
  EXPECT_GE(turned, 8) << "down along x2 the edge may come first";
  // x1 from 0.6 up to 0.5 + sqrt(0.3^2 - 0.2^2).
  EXPECT_NEAR(searcher.margins()[1].distance, std::sqrt(0.05) - 0.1, search.tolerance);
  // Where the start does not hold there is no margin.
  MarginSearcher none(search, {0.0, 0.0});
  static_cast<void>(none.Ask());
  none.Tell({{{}, 1.0}});
  EXPECT_TRUE(none.Ask().empty());
  EXPECT_TRUE(none.margins().empty());
}

}  // namespace
}  // namespace dexcheck::testing::sensitivity_test
