// dexcheck study slurm: the job that it prints can run.

#include <gmock/gmock.h>

#include "tests/common/matchers.h"
#include "tests/harness/cli/study_command.h"

namespace dexcheck::testing::study_slurm_script_test {
namespace {

TEST_F(StudyCommand, TheBatchScriptIsReady) {
  const ProgramResult result = RunDexcheck({"study", "slurm", Path("tiny.toml"), "--tasks", "7"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, ::testing::StartsWith("#!/bin/bash\n"));
  for (const char* part : {"#SBATCH --array=1-7\n", "#SBATCH --requeue\n", "--shard \"$task/7\""}) {
    EXPECT_THAT(result.out, HasSubstr(part));
  }
  EXPECT_THAT(result.out, ::testing::Not(HasSubstr("--time")));
  EXPECT_THAT(result.out, ::testing::Not(HasSubstr("--mem")));
  // Slurm's MaxArraySize is 1001 unless configured, and indices must be below it.
  const ProgramResult many = RunDexcheck({"study", "slurm", Path("tiny.toml"), "--tasks", "5000",
                                          "--throttle", "20", "--time", "1-02:30:00", "--memory", "2G"});
  EXPECT_EQ(many.exit_code, 0) << many.err;
  for (const char* part :
       {"#SBATCH --array=1-1000%20\n", "#SBATCH --time=1-02:30:00\n", "#SBATCH --mem=2G\n"}) {
    EXPECT_THAT(many.out, HasSubstr(part));
  }
}

TEST_F(StudyCommand, TheBatchScriptMakesTheStudyInFewElements) {
  const ProgramResult script =
      RunDexcheck({"study", "slurm", Path("tiny.toml"), "--tasks", "3", "--array-size", "2"});
  ASSERT_EQ(script.exit_code, 0) << script.err;
  EXPECT_THAT(script.out, HasSubstr("#SBATCH --array=1-2\n"));
  WriteText(folder_.path() / "job.sh", script.out);
  ProgramOptions options;
  options.folder = folder_.path();
  for (const char* element : {"1", "2"}) {
    options.environment = {{"SLURM_ARRAY_TASK_ID", element}, {"SLURM_CPUS_PER_TASK", "2"}};
    const ProgramResult result = RunProgram({"bash", "job.sh"}, options);
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }
  const ProgramResult merged = RunDexcheck({"study", "merge", Path("all.sqlite"), Path("tiny-1-of-3.sqlite"),
                                            Path("tiny-2-of-3.sqlite"), Path("tiny-3-of-3.sqlite")});
  EXPECT_EQ(merged.exit_code, 0) << merged.err;
  EXPECT_EQ(Dump(Path("all.sqlite")), Reference());
}

TEST_F(StudyCommand, NoJobIsPrintedThatCannotRun) {
  const auto slurm = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"study", "slurm", Path("tiny.toml"), "--tasks", "2"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunDexcheck(arguments);
  };
  for (const char* time :
       {"", "x", "1:", ":1", "1-", "1:2:3:4", "1h", "-1", "1 --wrap=x", "1\n#SBATCH -n9"}) {
    EXPECT_TRUE(IsRefused(slurm({"--time", time}), {"--time"})) << time;
  }
  for (const char* memory : {"", "G", "1.5G", "2GB", "2g", "-1", "2G\n"}) {
    EXPECT_TRUE(IsRefused(slurm({"--memory", memory}), {"--memory"})) << memory;
  }
  EXPECT_TRUE(IsRefused(slurm({"--throttle", "0"}), {"--throttle"}));
  EXPECT_TRUE(IsRefused(slurm({"--array-size", "0"}), {"--array-size"}));
  // Whatever study run refuses.
  for (const auto& [from, to] : {std::pair<std::string, std::string>{"control.K_v", "control.K_w"},
                                 {"settle=0.3", "settle=-1"},
                                 {"\"offset\"", "\"offsett\""},
                                 {"settle=0.3", "grasp.xyz=[0, 0, 9]"}}) {
    WriteText(folder_.path() / "tiny.toml", ReplaceOnce(kStudy, from, to));
    const ProgramResult run = RunDexcheck(RunArguments("a.sqlite"));
    const ProgramResult printed = slurm({});
    EXPECT_TRUE(IsRefused(printed, {}));
    EXPECT_EQ(printed.err, run.err);
  }
}

}  // namespace
}  // namespace dexcheck::testing::study_slurm_script_test
