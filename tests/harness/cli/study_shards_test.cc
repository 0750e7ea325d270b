// dexcheck study with shards: merged they become the study, and a batch job makes them.

#include <gmock/gmock.h>

#include <set>

#include "tests/common/matchers.h"
#include "tests/harness/cli/study_command.h"

namespace dexcheck::testing::study_shards_test {
namespace {

TEST_F(StudyCommand, MergedShardsAreTheStudy) {
  const std::string reference = Reference();
  for (const std::string shard : {"1", "2"}) {
    Make(shard + ".sqlite", {"--shard", shard + "/2"});
  }
  EXPECT_NE(Dump("1.sqlite"), reference);
  const ProgramResult merged = Expect(0, "study merge all.sqlite 1.sqlite 2.sqlite");
  EXPECT_THAT(merged.out, HasSubstr("tiny: 6 of 6 trials"));
  EXPECT_EQ(Dump("all.sqlite"), reference);

  WriteChanged("tiny.toml", kStudy, "duration=0.02", "duration=0.03");
  EXPECT_TRUE(Refused(RunArguments("1.sqlite"), {"1.sqlite: is of another study: key set differs"}));
  Make("other.sqlite", {"--shard", "1/6"});
  EXPECT_TRUE(Refused("study merge none.sqlite 1.sqlite other.sqlite",
                      {"other.sqlite: is of another study: key set differs"}));
  EXPECT_FALSE(Has("none.sqlite"));
}

TEST_F(StudyCommand, AMergeWithAConflictLeavesNothing) {
  Make("a.sqlite", {"--shard", "1/2"});
  std::filesystem::copy(Path("a.sqlite"), Path("b.sqlite"));
  OpenDatabase(Path("b.sqlite")).exec("UPDATE trials SET energy = energy * (1 + 1e-15) WHERE trial = 4");
  ASSERT_FALSE(Dump("a.sqlite") == Dump("b.sqlite"));
  const auto list = [&] {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
      names.insert(entry.path().filename());
    }
    return names;
  };
  const std::set<std::string> before = list();
  const std::string conflict = "b.sqlite: trial 4 has another result than in ";
  EXPECT_TRUE(Refused("study merge all.sqlite a.sqlite b.sqlite", {conflict + "a.sqlite"}));
  EXPECT_EQ(list(), before);
  // An existing database stays as it was.
  Make("all.sqlite", {"--shard", "2/3"});
  const std::string all = Dump("all.sqlite");
  EXPECT_TRUE(Refused("study merge all.sqlite a.sqlite b.sqlite", {conflict}));
  EXPECT_EQ(Dump("all.sqlite"), all);
}

TEST_F(StudyCommand, AnIncompleteMergeSaysWhatIsMissing) {
  Make("a.sqlite", {"--shard", "2/3"});
  const ProgramResult merged = Expect(3, "study merge all.sqlite a.sqlite");
  EXPECT_THAT(merged.out, HasSubstr("tiny: 2 of 6 trials"));
  EXPECT_THAT(merged.err, HasSubstr("all.sqlite: 4 of 6 trials are missing: 0, 2-3, 5; merge again"));
  EXPECT_EQ(CountRows("all.sqlite"), 2) << "what there is, is kept";
  // Into what is there, with the rest.
  Make("b.sqlite", {"--shard", "1/3"});
  Make("c.sqlite", {"--shard", "3/3"});
  Expect(0, "study merge all.sqlite c.sqlite b.sqlite");
  EXPECT_EQ(Dump("all.sqlite"), Reference());
}

// The C library's mathematics without fused multiply-add has other last bits: another machine.
TEST_F(StudyCommand, RowsOfOtherMachinesAreMergedWithinRounding) {
  ProgramOptions other;
  other.environment = {{"GLIBC_TUNABLES", "glibc.cpu.hwcaps=-AVX2,-FMA"}};
  Make("a.sqlite");
  Expect(0, RunArguments("b.sqlite"), other);
  const std::vector<TrialRow> here = ReadRows("a.sqlite");
  const std::vector<TrialRow> there = ReadRows("b.sqlite");
  if (here[0].machine == there[0].machine) GTEST_SKIP() << "this machine has no fused multiply-add";
  EXPECT_THAT(here[0].machine, HasSubstr(" FMA"));
  EXPECT_THAT(there[0].machine, Not(HasSubstr(" FMA;")));
  EXPECT_THAT(here[0].machine, HasSubstr("; glibc 2."));
  EXPECT_THAT(here[0].machine, HasSubstr("; MuJoCo 2.2.2; compiled by "));
  bool differs = false;
  for (size_t i = 0; i < here.size(); ++i) {
    TrialRow row = there[i];
    row.machine = here[i].machine;
    differs = differs || !IsSame(here[i], row);
  }
  EXPECT_TRUE(differs) << "the bits are the same: this test tests nothing";
  const ProgramResult merged = Expect(0, "study merge all.sqlite a.sqlite b.sqlite");
  EXPECT_EQ(Dump("all.sqlite"), Dump("a.sqlite")) << "the first one's rows";
  OpenDatabase(Path("b.sqlite"))
      .exec("UPDATE trials SET cone_margin = cone_margin * (1 + 1e-6) WHERE trial = 1");
  EXPECT_TRUE(Refused("study merge new.sqlite a.sqlite b.sqlite", {"b.sqlite: trial 1 has another result"}));
}

TEST_F(StudyCommand, TheBatchScriptIsReady) {
  const ProgramResult result = Expect(0, "study slurm tiny.toml --tasks 7");
  EXPECT_THAT(result.out, StartsWith("#!/bin/bash\n"));
  for (const char* part : {"#SBATCH --array=1-7\n", "#SBATCH --requeue\n", "--shard \"$task/7\""}) {
    EXPECT_THAT(result.out, HasSubstr(part));
  }
  EXPECT_THAT(result.out, Not(HasSubstr("--time")));
  EXPECT_THAT(result.out, Not(HasSubstr("--mem")));
  // Slurm's MaxArraySize is 1001 unless configured, and indices must be below it.
  const ProgramResult many =
      Expect(0, "study slurm tiny.toml --tasks 5000 --throttle 20 --time 1-02:30:00 --memory 2G");
  for (const char* part :
       {"#SBATCH --array=1-1000%20\n", "#SBATCH --time=1-02:30:00\n", "#SBATCH --mem=2G\n"}) {
    EXPECT_THAT(many.out, HasSubstr(part));
  }
}

TEST_F(StudyCommand, TheBatchScriptMakesTheStudyInFewElements) {
  const ProgramResult script = Expect(0, "study slurm tiny.toml --tasks 3 --array-size 2");
  EXPECT_THAT(script.out, HasSubstr("#SBATCH --array=1-2\n"));
  Write("job.sh", script.out);
  ProgramOptions options;
  options.folder = folder_.path();
  for (const char* element : {"1", "2"}) {
    options.environment = {{"SLURM_ARRAY_TASK_ID", element}, {"SLURM_CPUS_PER_TASK", "2"}};
    const ProgramResult result = RunProgram({"bash", "job.sh"}, options);
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }
  const ProgramResult merged =
      Expect(0, "study merge all.sqlite tiny-1-of-3.sqlite tiny-2-of-3.sqlite tiny-3-of-3.sqlite");
  EXPECT_EQ(Dump("all.sqlite"), Reference());
}

TEST_F(StudyCommand, NoJobIsPrintedThatCannotRun) {
  // Whatever study run refuses.
  for (const auto& [from, to] : {std::pair<std::string, std::string>{"control.K_v", "control.K_w"},
                                 {"settle=0.3", "settle=-1"},
                                 {"\"offset\"", "\"offsett\""},
                                 {"settle=0.3", "grasp.xyz=[0, 0, 9]"}}) {
    WriteChanged("tiny.toml", kStudy, from, to);
    const ProgramResult run = Run(RunArguments("a.sqlite"));
    const ProgramResult printed = Run("study slurm tiny.toml --tasks 2");
    EXPECT_TRUE(IsRefused(printed, {}));
    EXPECT_EQ(printed.err, run.err);
  }
}

}  // namespace
}  // namespace dexcheck::testing::study_shards_test
