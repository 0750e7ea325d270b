// NSGA-II beside Optuna's own, on the same problem with the same budget.

#include <gtest/gtest.h>

#include <cstdio>
#include <sstream>
#include <string>
#include <vector>

#include "tests/common/run_program.h"
#include "tests/harness/study/search_functions.h"

namespace dexcheck::testing::search_optuna_test {
namespace {

constexpr long kPoints = 480;
constexpr int kSeeds = 3;

// Values of the points of each seed, all on one line.
const std::string kOptuna = R"(
import math, optuna
optuna.logging.set_verbosity(optuna.logging.ERROR)
def zdt1(trial):
    x = [trial.suggest_float(f"x{i}", 0, 1) for i in range(4)]
    g = 1 + 3 * (x[1] + x[2] + x[3])
    return x[0], g * (1 - math.sqrt(x[0] / g))
for seed in range(3):
    sampler = optuna.samplers.NSGAIISampler(population_size=24, seed=seed)
    study = optuna.create_study(directions=["minimize", "minimize"], sampler=sampler)
    study.optimize(zdt1, n_trials=480)
    print(" ".join(f"{a!r} {b!r}" for a, b in (t.values for t in study.trials)))
)";

TEST(SearchOptuna, Nsga2HasNoLessHypervolumeThanOptunas) {
  const testing::ProgramResult result =
      testing::RunProgram({"/usr/bin/python3", "-W", "ignore", "-c", kOptuna});
  if (result.err.find("No module named 'optuna'") != std::string::npos) GTEST_SKIP() << "no Optuna here";
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::istringstream lines(result.out);
  double ours = 0.0;
  double theirs = 0.0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    std::string line;
    ASSERT_TRUE(std::getline(lines, line));
    std::istringstream numbers(line);
    std::vector<JudgedPoint> points;
    for (double a = 0.0, b = 0.0; numbers >> a >> b;) points.push_back({0, {}, {{a, b}, 0.0}});
    ASSERT_EQ(points.size(), static_cast<size_t>(kPoints));
    theirs += testing::CalcHypervolume(FindFront(points)) / kSeeds;
    Search search = testing::MakeSearch(SearchMethod::kNsga2, kPoints);
    search.population = 24;
    search.seed = static_cast<std::uint64_t>(seed);
    ours +=
        testing::CalcHypervolume(FindFront(testing::RunSearch(search, {0.5, 0.5, 0.5, 0.5}, testing::Zdt1))) /
        kSeeds;
  }
  EXPECT_GT(theirs, 0.5) << "it was understood";
  EXPECT_GE(ours, theirs);
  std::printf("hypervolume, mean of %d seeds with %ld points: %.4f, Optuna %.4f\n", kSeeds, kPoints, ours,
              theirs);
}

}  // namespace
}  // namespace dexcheck::testing::search_optuna_test
