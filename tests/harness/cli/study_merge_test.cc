// dexcheck study merge: shards become the study, or nothing is written.

#include <gmock/gmock.h>

#include <set>

#include "tests/common/matchers.h"
#include "tests/harness/cli/study_command.h"

namespace dexcheck::testing::study_merge_test {
namespace {

TEST_F(StudyCommand, MergedShardsAreTheStudy) {
  const std::string reference = Reference();
  for (const std::string shard : {"1", "2"}) {
    ASSERT_EQ(RunDexcheck(RunArguments(shard + ".sqlite", {"--shard", shard + "/2"})).exit_code, 0);
  }
  EXPECT_NE(Dump(Path("1.sqlite")), reference);
  const ProgramResult merged =
      RunDexcheck({"study", "merge", Path("all.sqlite"), Path("1.sqlite"), Path("2.sqlite")});
  EXPECT_EQ(merged.exit_code, 0) << merged.err;
  EXPECT_THAT(merged.out, HasSubstr("tiny: 6 of 6 trials"));
  EXPECT_EQ(Dump(Path("all.sqlite")), reference);

  WriteText(folder_.path() / "tiny.toml", ReplaceOnce(kStudy, "duration=0.02", "duration=0.03"));
  EXPECT_TRUE(
      IsRefused(RunDexcheck(RunArguments("1.sqlite")), {"1.sqlite: is of another study: study differs"}));
  ASSERT_EQ(RunDexcheck(RunArguments("other.sqlite", {"--shard", "1/6"})).exit_code, 0);
  EXPECT_TRUE(
      IsRefused(RunDexcheck({"study", "merge", Path("none.sqlite"), Path("1.sqlite"), Path("other.sqlite")}),
                {"other.sqlite: is of another study: study differs"}));
  EXPECT_FALSE(std::filesystem::exists(Path("none.sqlite")));
}

TEST_F(StudyCommand, AMergeWithAConflictLeavesNothing) {
  ASSERT_EQ(RunDexcheck(RunArguments("a.sqlite", {"--shard", "1/2"})).exit_code, 0);
  std::filesystem::copy(Path("a.sqlite"), Path("b.sqlite"));
  OpenDatabase(Path("b.sqlite")).exec("UPDATE trials SET energy = energy * (1 + 1e-15) WHERE trial = 4");
  ASSERT_FALSE(Dump(Path("a.sqlite")) == Dump(Path("b.sqlite")));
  const auto list = [&] {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
      names.insert(entry.path().filename());
    }
    return names;
  };
  const std::set<std::string> before = list();
  const std::string conflict = "b.sqlite: trial 4 has another result than in ";
  EXPECT_TRUE(
      IsRefused(RunDexcheck({"study", "merge", Path("all.sqlite"), Path("a.sqlite"), Path("b.sqlite")}),
                {conflict + Path("a.sqlite")}));
  EXPECT_EQ(list(), before);
  // What was there stays as it was.
  ASSERT_EQ(RunDexcheck(RunArguments("all.sqlite", {"--shard", "2/3"})).exit_code, 0);
  const std::string all = Dump(Path("all.sqlite"));
  EXPECT_TRUE(IsRefused(
      RunDexcheck({"study", "merge", Path("all.sqlite"), Path("a.sqlite"), Path("b.sqlite")}), {conflict}));
  EXPECT_EQ(Dump(Path("all.sqlite")), all);
}

TEST_F(StudyCommand, AnIncompleteMergeSaysWhatIsMissing) {
  ASSERT_EQ(RunDexcheck(RunArguments("a.sqlite", {"--shard", "2/3"})).exit_code, 0);
  const ProgramResult merged = RunDexcheck({"study", "merge", Path("all.sqlite"), Path("a.sqlite")});
  EXPECT_EQ(merged.exit_code, 3);
  EXPECT_THAT(merged.out, HasSubstr("tiny: 2 of 6 trials"));
  EXPECT_THAT(merged.err, HasSubstr("all.sqlite: 4 of 6 trials are missing: 0, 2-3, 5; merge again"));
  EXPECT_EQ(CountRows("all.sqlite"), 2) << "what there is, is kept";
  // Into what is there, with the rest.
  ASSERT_EQ(RunDexcheck(RunArguments("b.sqlite", {"--shard", "1/3"})).exit_code, 0);
  ASSERT_EQ(RunDexcheck(RunArguments("c.sqlite", {"--shard", "3/3"})).exit_code, 0);
  EXPECT_EQ(RunDexcheck({"study", "merge", Path("all.sqlite"), Path("c.sqlite"), Path("b.sqlite")}).exit_code,
            0);
  EXPECT_EQ(Dump(Path("all.sqlite")), Reference());
}

// The C library's mathematics without fused multiply-add has other last bits: another machine.
TEST_F(StudyCommand, RowsOfOtherMachinesAreMergedWithinRounding) {
  ProgramOptions other;
  other.environment = {{"GLIBC_TUNABLES", "glibc.cpu.hwcaps=-AVX2,-FMA"}};
  ASSERT_EQ(RunDexcheck(RunArguments("a.sqlite")).exit_code, 0);
  ASSERT_EQ(RunDexcheck(RunArguments("b.sqlite"), other).exit_code, 0);
  const std::vector<TrialRow> here = StudyStore::Open(Path("a.sqlite")).ReadRows();
  const std::vector<TrialRow> there = StudyStore::Open(Path("b.sqlite")).ReadRows();
  if (here[0].machine == there[0].machine) GTEST_SKIP() << "this machine has no fused multiply-add";
  EXPECT_THAT(here[0].machine, HasSubstr(" FMA"));
  EXPECT_THAT(there[0].machine, ::testing::Not(HasSubstr(" FMA;")));
  EXPECT_THAT(here[0].machine, HasSubstr("; glibc 2."));
  EXPECT_THAT(here[0].machine, HasSubstr("; MuJoCo 2.2.2; compiled by "));
  bool differs = false;
  for (size_t i = 0; i < here.size(); ++i) {
    TrialRow row = there[i];
    row.machine = here[i].machine;
    differs = differs || !IsSame(here[i], row);
  }
  EXPECT_TRUE(differs) << "the bits are the same: this test tests nothing";
  const ProgramResult merged =
      RunDexcheck({"study", "merge", Path("all.sqlite"), Path("a.sqlite"), Path("b.sqlite")});
  EXPECT_EQ(merged.exit_code, 0) << merged.err;
  EXPECT_EQ(Dump(Path("all.sqlite")), Dump(Path("a.sqlite"))) << "the first one's rows";
  OpenDatabase(Path("b.sqlite"))
      .exec("UPDATE trials SET cone_margin = cone_margin * (1 + 1e-6) WHERE trial = 1");
  EXPECT_TRUE(
      IsRefused(RunDexcheck({"study", "merge", Path("new.sqlite"), Path("a.sqlite"), Path("b.sqlite")}),
                {"b.sqlite: trial 1 has another result"}));
}

}  // namespace
}  // namespace dexcheck::testing::study_merge_test
