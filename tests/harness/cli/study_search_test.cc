// dexcheck study run with a search: killed, and by several processes; the rows must come out the same.

#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <thread>

#include "harness/study/search.h"
#include "tests/common/matchers.h"
#include "tests/harness/cli/study_command.h"

namespace dexcheck::testing::study_search_test {
namespace {

// Gains of a run so short that the error hardly moves: the object's own weight and the start error decide.
const std::string kSearch = R"(name = "tiny"
scenario = "offset"
set = ["duration=0.02", "settle=0.3", "start_error.xyz=[1e-6, 0, 0]"]
seeds = [0, 1]
[search]
method = "cma_es"
count = 24
population = 8
[[objective]]
minimize = "position_error_rms"
aggregate = "worst"
[[vary]]
key = "control.K_p"
from = 100
to = 1e4
spacing = "log"
[[vary]]
key = "control.K_v"
from = 20
to = 1500
spacing = "log"
)";

class StudySearch : public StudyCommand {
 protected:
  StudySearch() { Write("tiny.toml", kSearch); }
};

TEST_F(StudySearch, GivesTheSameRowsKilledOrSharedOrAlone) {
  const auto begun = std::chrono::steady_clock::now();
  const ProgramResult whole = Run(RunArguments("whole.sqlite", {"--jobs", "1"}));
  std::chrono::duration<double> time = std::chrono::steady_clock::now() - begun;
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  EXPECT_THAT(whole.out, HasSubstr("tiny: 48 of at most 48 trials"));
  EXPECT_THAT(whole.out, HasSubstr("The least position_error_rms, worst of its trials of 24 points is "));
  const std::string reference = Dump("whole.sqlite");
  // The best point found is better than the first one.
  const Study study = ParseStudy(kSearch, "tiny.toml");
  const auto points = JudgePoints(study, ReadRows("whole.sqlite"));
  ASSERT_EQ(points.size(), 24U);
  ASSERT_FALSE(SortFeasible(points).empty());
  EXPECT_LT(SortFeasible(points).front()->judgement.objectives[0], points[0].judgement.objectives[0]);

  // Killed again and again, at any time of a search; one that came to its end is begun anew.
  // DEXCHECK_KILLS=200 kills it so often.
  const char* const more = std::getenv("DEXCHECK_KILLS");
  const long kills = more == nullptr ? 4 : std::clamp(std::atol(more), 1L, 100000L);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> fraction(0.1, 0.8);
  long midway = 0;
  long searches = 1;
  long made_before = 0;  // kills of earlier searches
  for (long made = 0; made < kills;) {
    {
      const Program killed(DexcheckCommand(RunArguments("killed.sqlite", {"--jobs", "2"})), {});
      std::this_thread::sleep_for(fraction(random) * time);
    }
    const long rows = CountRows("killed.sqlite");
    if (rows < 48) {
      ++made;
      if (rows > 0) ++midway;
      continue;
    }
    EXPECT_EQ(Dump("killed.sqlite"), reference) << "after " << made << " kills";
    for (const char* const part : {"", "-journal", "-wal", "-shm"})
      std::filesystem::remove(Path(std::string("killed.sqlite") + part));
    ++searches;
    // On a machine that was busy and is so no longer each would come to its end.
    if (made == made_before) time *= 0.8;
    made_before = made;
  }
  EXPECT_GT(midway, 0) << "it was killed too early to matter";
  std::printf("%ld kills, %ld of them midway, in %ld searches\n", kills, midway, searches);
  Make("killed.sqlite");
  EXPECT_EQ(Dump("killed.sqlite"), reference);

  Program one(DexcheckCommand(RunArguments("shared.sqlite", {"--jobs", "1"})), {});
  Program other(DexcheckCommand(RunArguments("shared.sqlite", {"--jobs", "1"})), {});
  for (const ProgramResult& result : {one.Wait(), other.Wait()}) EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(Dump("shared.sqlite"), reference);
}

TEST_F(StudySearch, StopsTrialsThatAreLost) {
  Write("tiny.toml", R"(name = "tiny"
scenario = "offset"
set = ["duration=0.02", "settle=0.3"]
stop_error = 2e-6
[[vary]]
key = "start_error.xyz"
values = [[1e-6, 0, 0], [3e-6, 0, 0]]
)");
  Make("a.sqlite", {"--quiet"});
  const std::vector<TrialRow> rows = ReadRows("a.sqlite");
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].result.outcome, Outcome::kTracked);
  EXPECT_EQ(rows[1].result.outcome, Outcome::kDiverged);
  EXPECT_EQ(rows[1].result.failure, "the position error is above stop_error, 2e-06 m at t = 0 s");
  EXPECT_EQ(rows[1].result.metrics[kSimulatedTime], 0.001) << "it is kept, as far as it came";
}

TEST_F(StudySearch, IsShownAndExported) {
  Make("a.sqlite", {"--quiet"});
  const std::vector<TrialRow> rows = ReadRows("a.sqlite");
  const ProgramResult shown = Expect(0, "study show a.sqlite 17");
  EXPECT_THAT(shown.out, HasSubstr("trial 17, seed 1: tracked"));
  const auto trial = RunJson(0, "study show a.sqlite 17");
  EXPECT_EQ(trial["outcome"], "tracked");
  EXPECT_EQ(trial["metrics"]["position_error_rms"], rows[17].result.metrics[kPositionErrorRms]);
  EXPECT_THAT(trial["command"].get<std::string>(), HasSubstr("dexcheck run offset --set duration=0.02"));
  const ProgramResult csv = Expect(0, "study export a.sqlite --out -");
  EXPECT_EQ(std::ranges::count(csv.out, '\n'), 49);
  EXPECT_THAT(csv.out, StartsWith("trial,seed,control.K_p,control.K_v,outcome,failure,position_error_rms,"));
  // Numbers read back as they were.
  size_t at = csv.out.find("\n17,1,") + 6;
  EXPECT_EQ(std::strtod(csv.out.c_str() + at, nullptr), rows[17].trial.parameters[0]);
}

TEST_F(StudySearch, IsMadeByOneCommand) {
  const ProgramResult script = Expect(0, "study slurm tiny.toml --tasks 1 --cpus 16");
  EXPECT_THAT(script.out, HasSubstr("#SBATCH --cpus-per-task=16\n"));
  EXPECT_THAT(script.out, Not(HasSubstr("--shard")));
}

}  // namespace
}  // namespace dexcheck::testing::study_search_test
