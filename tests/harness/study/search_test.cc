// Searches on functions whose best points are known, and through the rows of a study.

#include "harness/study/search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "tests/common/throws.h"
#include "tests/harness/study/study_fixture.h"

namespace dexcheck::testing::search_test {
namespace {

using Function = std::function<double(const UnitPoint&)>;

Search MakeSearch(SearchMethod method, long count) {
  Search search;
  search.method = method;
  search.count = count;
  search.population = 16;
  search.seed = 3;
  return search;
}

/// Values of all points that a search asks within its count, in their order.
std::vector<JudgedPoint> RunSearch(const Search& search, const UnitPoint& start, const Function& function) {
  const auto searcher = MakeSearcher(search, start);
  std::vector<JudgedPoint> points;
  while (static_cast<long>(points.size()) < search.count) {
    const std::vector<UnitPoint> batch = searcher->Ask();
    if (batch.empty()) break;
    std::vector<Judgement> judgements;
    for (const UnitPoint& point : batch) {
      for (const double x : point) {
        EXPECT_GE(x, 0.0);
        EXPECT_LE(x, 1.0);
      }
      judgements.push_back({{function(point)}, 0.0});
      points.push_back({static_cast<long>(points.size()), point, judgements.back()});
    }
    searcher->Observe(judgements);
  }
  return points;
}

/// An ellipsoid of condition 100 around (0.3, 0.6, 0.45), turned against the axes.
double Ellipsoid(const UnitPoint& x) {
  const double a = x[0] - 0.3;
  const double b = x[1] - 0.6;
  const double c = x[2] - 0.45;
  return (a + b) * (a + b) + 10.0 * (b - c) * (b - c) + 100.0 * (a - c) * (a - c);
}

constexpr double kFound = 1e-6;  // of the ellipsoid, 1e-3 of a range away from its middle

TEST(Search, FindsTheMinimum) {
  const UnitPoint start = {0.9, 0.1, 0.8};
  ASSERT_GT(Ellipsoid(start), 1e3 * kFound);
  for (const auto& [method, count] :
       {std::pair{SearchMethod::kCmaEs, 800L}, {SearchMethod::kNelderMead, 300L}}) {
    Search search = MakeSearch(method, count);
    search.tolerance = 1e-5;
    const auto points = RunSearch(search, start, Ellipsoid);
    ASSERT_FALSE(SortFeasible(points).empty());
    EXPECT_LT(SortFeasible(points).front()->judgement.objectives[0], kFound)
        << static_cast<int>(method) << ": " << points.size();
    EXPECT_EQ(points.front().values, start);
  }
}

// Two valleys: one local search ends in the nearer, worse one, several find the other.
TEST(Search, SeveralStartsFindTheBetterValley) {
  const Function valleys = [](const UnitPoint& x) {
    const double near = std::hypot(x[0] - 0.2, x[1] - 0.2);
    const double far = std::hypot(x[0] - 0.8, x[1] - 0.75);
    return std::min(near + 0.3, far);
  };
  Search search = MakeSearch(SearchMethod::kNelderMead, 100);
  EXPECT_NEAR(SortFeasible(RunSearch(search, {0.3, 0.2}, valleys)).front()->judgement.objectives[0], 0.3,
              0.01);
  search.count = 400;
  search.starts = 4;
  EXPECT_LT(SortFeasible(RunSearch(search, {0.3, 0.2}, valleys)).front()->judgement.objectives[0], 0.01);
}

// A minimum on the edge of the range, where a search that knows no bounds would leave it.
TEST(Search, FindsAMinimumOnTheEdge) {
  const Function slope = [](const UnitPoint& x) { return x[0] + (x[1] - 0.5) * (x[1] - 0.5); };
  for (const SearchMethod method : {SearchMethod::kCmaEs, SearchMethod::kNelderMead}) {
    const auto points = RunSearch(MakeSearch(method, 480), {0.7, 0.2}, slope);
    EXPECT_LT(SortFeasible(points).front()->judgement.objectives[0], 1e-3) << static_cast<int>(method);
    EXPECT_EQ(SortFeasible(points).front()->values[0], 0.0)
        << "on the edge itself: " << static_cast<int>(method);
  }
}

// Two keys, a dense grid of 400 points against a tenth of it: corner, valley along an edge, what error and
// effort of a loop look like, a turned valley inside, an edge. DEXCHECK_SEARCH_SEEDS=40 tries that many
// seeds.
TEST(Search, ATenthOfAGridsTrialsIsEnough) {
  const std::vector<Function> functions = {
      [](const UnitPoint& x) { return 1.0 + 3.0 * (1.0 - x[0]) + 2.0 * (1.0 - x[1]); },
      [](const UnitPoint& x) {
        const double off = x[1] - 0.3 - 0.5 * x[0];
        return 0.1 + 20.0 * off * off + 1.0 - x[0];
      },
      [](const UnitPoint& x) {
        const double w = 5.0 * std::pow(30.0, x[0]);
        const double z = 0.3 * std::pow(10.0, x[1]);
        return 400.0 / (w * w) * (1.0 + 0.2 * z * z) + 0.01 * w * z +
               std::exp(std::min(50.0, (w * z - 260.0) / 20.0));
      },
      [](const UnitPoint& x) {
        const double a = x[0] - 0.3;
        const double b = x[1] - 0.65;
        return 0.1 + a * a + 10.0 * (a - b) * (a - b);
      },
      [](const UnitPoint& x) { return 0.2 + x[0] + 4.0 * (x[1] - 0.4) * (x[1] - 0.4); }};
  const char* const more = std::getenv("DEXCHECK_SEARCH_SEEDS");
  const long seeds = more == nullptr ? 3 : std::clamp(std::atol(more), 1L, 1000L);
  for (size_t i = 0; i < functions.size(); ++i) {
    const Function& function = functions[i];
    double grid = 1e300;
    for (int j = 0; j < 400; ++j) grid = std::min(grid, function({j % 20 / 19.0, j / 20 / 19.0}));
    long found = 0;
    for (long seed = 1; seed <= seeds; ++seed) {
      Search search = MakeSearch(SearchMethod::kNelderMead, 40);
      search.seed = static_cast<std::uint64_t>(seed);
      search.starts = 2;
      const std::vector<JudgedPoint> points = RunSearch(search, {0.5, 0.5}, function);
      ASSERT_LE(points.size(), 40U);
      EXPECT_GT(points.front().judgement.objectives[0], 1.05 * grid) << "it did not begin there";
      if (SortFeasible(points).front()->judgement.objectives[0] < 1.05 * grid) ++found;
    }
    EXPECT_EQ(found, seeds) << "function " << i;
  }
}

// The front against its definition, of points at random, a fifth of which are not feasible.
TEST(Search, TheFrontIsWhatNoPointBeats) {
  std::vector<JudgedPoint> points;
  for (const UnitPoint& x : MakeRandom(3, 200, 5)) {
    const double f1 = std::round(10.0 * x[0]), f2 = std::round(10.0 * x[1]);  // some are equal
    points.push_back({static_cast<long>(points.size()), {}, {{f1, f2}, std::max(0.0, x[2] - 0.8)}});
  }
  std::vector<const JudgedPoint*> front = FindFront(points);
  EXPECT_TRUE(
      std::ranges::is_sorted(front, {}, [](const JudgedPoint* p) { return p->judgement.objectives; }));
  std::vector<const JudgedPoint*> expected;
  for (const JudgedPoint& point : points) {
    const auto beats = [&](const JudgedPoint& other) { return Dominates(other.judgement, point.judgement); };
    if (point.judgement.is_feasible() && std::ranges::none_of(points, beats)) expected.push_back(&point);
  }
  std::ranges::sort(front);
  EXPECT_EQ(front, expected);
  EXPECT_GT(front.size(), 1U);
}

// Less violation leads back where constraints do not hold.
TEST(Search, LeavesWhatIsForbidden) {
  Search search = MakeSearch(SearchMethod::kCmaEs, 320);
  const auto searcher = MakeSearcher(search, {0.9, 0.9});
  double best = 1e9;
  for (long i = 0; i < search.count; i += search.population) {
    std::vector<Judgement> judgements;
    for (const UnitPoint& x : searcher->Ask()) {
      const double violation = std::max(x[0] + x[1] - 0.3, 0.0);  // a small corner is allowed
      judgements.push_back({{-x[0]}, violation});
      if (violation <= 0.0) best = std::min(best, -x[0]);
    }
    searcher->Observe(judgements);
  }
  EXPECT_LT(best, -0.28);
}

const std::string kStudy = R"(name = "s"
scenario = "hold"
seeds = [0, 1, 2]
[[objective]]
minimize = "energy"
[search]
method = "cma_es"
count = 50
population = 8
[[vary]]
key = "a"
from = 1
to = 100
spacing = "log"
[[vary]]
key = "b"
from = -1
to = 1
)";

TrialRow MakeRow(const Trial& trial) {
  TrialRow row = MakeTrialRow(trial);
  const double a = std::log(trial.parameters[0] / 20.0);
  row.result.metrics[kEnergy] =
      a * a + trial.parameters[1] * trial.parameters[1] + 0.01 * static_cast<double>(trial.seed);
  return row;
}

/// Makes the search's trials until `stop` have been made; the last batch in disorder.
void Follow(SearchHistory* history, size_t stop, std::vector<TrialRow>* rows) {
  std::mt19937 random(7);
  while (!history->is_over()) {
    std::vector<Trial> batch = history->ListMissing();
    std::shuffle(batch.begin(), batch.end(), random);
    for (const Trial& trial : batch) {
      if (rows->size() == stop) return;
      rows->push_back(MakeRow(trial));
      history->Add(rows->back());
    }
  }
}

TEST(SearchHistory, GoesOnFromItsRowsWhereverItWasStopped) {
  const Study study = ParseStudy(kStudy, "study.toml");
  SearchHistory whole(study);
  std::vector<TrialRow> all;
  Follow(&whole, SIZE_MAX, &all);
  ASSERT_EQ(all.size(), 48U * 3U) << "six times 8 within 50 points, 3 seeds of each";
  EXPECT_EQ(static_cast<long>(all.size()), CountTrials(study));
  ASSERT_EQ(whole.points().size(), 48U);
  EXPECT_LT(SortFeasible(whole.points()).front()->judgement.objectives[0],
            whole.points()[0].judgement.objectives[0]);
  for (const size_t stop : {size_t{0}, size_t{1}, size_t{23}, size_t{24}, size_t{100}, all.size() - 1}) {
    std::vector<TrialRow> rows;
    {
      SearchHistory stopped(study);
      Follow(&stopped, stop, &rows);
    }
    SearchHistory again(study);
    for (const TrialRow& row : std::vector<TrialRow>(rows)) again.Add(row);
    Follow(&again, SIZE_MAX, &rows);
    ASSERT_EQ(rows.size(), all.size()) << stop;
    std::vector<TrialRow> expected = all;
    for (std::vector<TrialRow>* const some : {&rows, &expected})
      std::sort(some->begin(), some->end(),
                [](const TrialRow& a, const TrialRow& b) { return a.trial.number < b.trial.number; });
    for (size_t i = 0; i < rows.size(); ++i)
      EXPECT_EQ(rows[i].trial.parameters, expected[i].trial.parameters) << i;
  }
}

TEST(SearchHistory, EachPointHasTheSameSeeds) {
  const Study study = ParseStudy(kStudy, "study.toml");
  const std::vector<Trial> batch = SearchHistory(study).ListMissing();
  ASSERT_EQ(batch.size(), 24U);
  for (size_t i = 0; i < batch.size(); ++i) {
    EXPECT_EQ(batch[i].number, static_cast<long>(i));
    EXPECT_EQ(batch[i].seed, i % 3);
    EXPECT_EQ(batch[i].parameters, batch[i - i % 3].parameters);
  }
}

TEST(SearchHistory, RowsOfAnotherSearchAreRefused) {
  const Study study = ParseStudy(kStudy, "study.toml");
  SearchHistory history(study);
  std::vector<TrialRow> rows;
  Follow(&history, 100, &rows);
  rows[60].trial.parameters[0] *= 1.0 + 1e-15;
  EXPECT_TRUE(Throws<InputError>(
      [&] {
        SearchHistory again(study);
        for (const TrialRow& row : rows) again.Add(row);
        return 0;
      },
      "is not what this search makes of the trials before it"));
}

}  // namespace
}  // namespace dexcheck::testing::search_test
