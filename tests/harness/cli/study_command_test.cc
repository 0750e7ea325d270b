// dexcheck study: interrupted, concurrent, sharded, on full disks; the rows must come out the same.

#include <gmock/gmock.h>
#include <sqlite3.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <thread>

#include "harness/study/study_store.h"
#include "tests/common/paths.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck {
namespace {

using testing::DexcheckCommand;
using ::testing::HasSubstr;
using testing::IsRefused;
using testing::Program;
using testing::ProgramOptions;
using testing::ProgramResult;
using testing::RunDexcheck;
using testing::TempFolder;
using testing::WriteText;

// Six trials, one of which diverges.
const std::string kStudy = R"(name = "tiny"
scenario = "offset"
set = ["duration=0.02", "settle=0.3", "start_error.xyz=[1e-6, 0, 0]"]
[[vary]]
key = "control.K_p"
values = [100, 1e4]
[[vary]]
key = "control.K_v"
values = [20, 200, 2100]
)";
constexpr size_t kNumTrials = 6;
/// Where settling leaves the object, m; a twentieth of the start error, measured 5e-9.
constexpr double kSettled = 5e-8;

/// Every value of the tables that make up a study, with its type, row by row.
std::string Dump(const std::filesystem::path& path) {
  Database database(path, Database::Mode::kExisting);
  std::string text;
  for (const char* sql :
       {"SELECT * FROM study", "SELECT * FROM trials ORDER BY trial", "PRAGMA integrity_check"}) {
    sqlite3_stmt* statement = nullptr;
    EXPECT_EQ(sqlite3_prepare_v2(database.handle(), sql, -1, &statement, nullptr), SQLITE_OK);
    while (sqlite3_step(statement) == SQLITE_ROW) {
      for (int i = 0; i < sqlite3_column_count(statement); ++i) {
        const void* const bytes = sqlite3_column_type(statement, i) == SQLITE_FLOAT ? nullptr : "";
        if (bytes == nullptr) {
          char number[64];
          std::snprintf(number, sizeof(number), "%a", sqlite3_column_double(statement, i));
          text += number;
        } else if (sqlite3_column_type(statement, i) != SQLITE_NULL) {
          text += reinterpret_cast<const char*>(sqlite3_column_text(statement, i));
        }
        text += '|';
      }
      text += '\n';
    }
    sqlite3_finalize(statement);
  }
  return text;
}

class StudyCommand : public ::testing::Test {
 protected:
  StudyCommand() { WriteText(folder_.path() / "tiny.toml", kStudy); }

  [[nodiscard]] std::vector<std::string> RunArguments(const std::string& database,
                                                      std::vector<std::string> more = {}) const {
    std::vector<std::string> arguments = {"study", "run", Path("tiny.toml"), "--db", Path(database)};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  [[nodiscard]] std::string Path(const std::string& file) const { return folder_.path() / file; }

  [[nodiscard]] long CountRows(const std::string& file) const {
    if (!std::filesystem::exists(Path(file))) return 0;
    Database database(Path(file), Database::Mode::kExisting);
    Statement tables(&database, "SELECT count(*) FROM sqlite_master WHERE name = 'trials'");
    tables.Step();
    if (tables.GetWhole(0) == 0) return 0;
    Statement rows(&database, "SELECT count(*) FROM trials");
    rows.Step();
    return static_cast<long>(rows.GetWhole(0));
  }

  /// Rows of the uninterrupted study, made once.
  const std::string& Reference() {
    static const auto reference = std::make_unique<std::string>();
    if (reference->empty()) {
      const ProgramResult result = RunDexcheck(RunArguments("reference.sqlite"));
      EXPECT_EQ(result.exit_code, 0) << result.err;
      EXPECT_THAT(result.out, HasSubstr("tiny: 6 of 6 trials"));
      *reference = Dump(Path("reference.sqlite"));
    }
    return *reference;
  }

  TempFolder folder_;
};

TEST_F(StudyCommand, ClassifiesItsTrials) {
  ASSERT_EQ(RunDexcheck(RunArguments("a.sqlite", {"--quiet"})).exit_code, 0);
  const std::vector<TrialRow> rows = StudyStore::Open(Path("a.sqlite")).ReadRows();
  ASSERT_EQ(rows.size(), kNumTrials);
  for (const TrialRow& row : rows) {
    const bool stable = row.trial.parameters[1] < 2000.0;
    EXPECT_EQ(row.result.outcome == Outcome::kTracked, stable) << row.trial.number;
    EXPECT_EQ(row.result.failure.empty(), stable) << row.result.failure;
    if (!stable) continue;
    EXPECT_NEAR(row.result.metrics[kPositionErrorMax], 1e-6, kSettled) << "the start error is the largest";
    EXPECT_LT(row.result.metrics[kPositionErrorRms], 1e-6);
    EXPECT_GT(row.result.metrics[kPositionErrorRms], 0.0);
    EXPECT_GT(row.result.metrics[kConeMargin], 0.0);
    EXPECT_GT(row.result.metrics[kPeakEffort], 0.0);
    EXPECT_LT(row.result.metrics[kPeakEffort], 1.0);
    EXPECT_GT(row.result.metrics[kEnergy], 0.0);
  }
}

TEST_F(StudyCommand, TheNumberOfProcessesDoesNotMatter) {
  for (const std::string jobs : {"1", "2", "6"}) {
    ASSERT_EQ(RunDexcheck(RunArguments(jobs + ".sqlite", {"--jobs", jobs})).exit_code, 0);
    EXPECT_EQ(Dump(Path(jobs + ".sqlite")), Reference()) << jobs;
  }
}

TEST_F(StudyCommand, GivesTheSameRowsHoweverOftenItIsKilled) {
  const std::string reference = Reference();
  std::mt19937 random(5);
  std::uniform_int_distribution<int> milliseconds(20, 400);
  constexpr int kKills = 20;
  int unfinished = 0;
  for (int i = 0; i < kKills; ++i) {
    {
      const Program killed(DexcheckCommand(RunArguments("a.sqlite", {"--jobs", "2"})), {});
      std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds(random)));
    }
    if (CountRows("a.sqlite") < static_cast<long>(kNumTrials)) {
      ++unfinished;
      continue;
    }
    // Done in spite of it all: once more from the beginning.
    EXPECT_EQ(Dump(Path("a.sqlite")), reference) << i;
    std::filesystem::remove(Path("a.sqlite"));
  }
  EXPECT_GE(unfinished, 5) << "it was killed too late to matter";
  EXPECT_EQ(RunDexcheck(RunArguments("a.sqlite")).exit_code, 0);
  EXPECT_EQ(Dump(Path("a.sqlite")), reference);
}

TEST_F(StudyCommand, TwoWritersLoseNothing) {
  const std::string reference = Reference();
  Program one(DexcheckCommand(RunArguments("a.sqlite", {"--jobs", "1"})), {});
  Program other(DexcheckCommand(RunArguments("a.sqlite", {"--jobs", "1"})), {});
  const ProgramResult first = one.Wait();
  const ProgramResult second = other.Wait();
  // The one that ends first may leave a last trial to the other.
  EXPECT_TRUE(first.exit_code == 0 || second.exit_code == 0) << first.err << second.err;
  for (const ProgramResult& result : {first, second}) {
    if (result.exit_code != 0) EXPECT_THAT(result.err, HasSubstr("another process has them"));
  }
  EXPECT_EQ(Dump(Path("a.sqlite")), reference);
}

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

  WriteText(folder_.path() / "tiny.toml", testing::ReplaceOnce(kStudy, "duration=0.02", "duration=0.03"));
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
  Database(Path("b.sqlite"), Database::Mode::kExisting)
      .Execute("UPDATE trials SET energy = energy * (1 + 1e-15) WHERE trial = 4");
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
  Database(Path("b.sqlite"), Database::Mode::kExisting)
      .Execute("UPDATE trials SET cone_margin = cone_margin * (1 + 1e-6) WHERE trial = 1");
  EXPECT_TRUE(
      IsRefused(RunDexcheck({"study", "merge", Path("new.sqlite"), Path("a.sqlite"), Path("b.sqlite")}),
                {"b.sqlite: trial 1 has another result"}));
}

// One trial that takes about two seconds of processor time, and one that takes none to speak of.
const std::string kSlowStudy = R"(name = "slow"
scenario = "offset"
set = ["settle=0.3"]
[[vary]]
key = "duration"
values = [20, 0.02]
)";

TEST_F(StudyCommand, ATrialThatIsAlwaysKilledEndsNoStudyAndCanBeRetried) {
  WriteText(folder_.path() / "tiny.toml", kSlowStudy);
  std::vector<std::string> limited = DexcheckCommand(RunArguments("a.sqlite", {"--jobs", "2"}));
  // With a hard limit of its processor time the system kills every process that takes more.
  limited.insert(limited.begin(), {"prlimit", "--cpu=1:1"});
  const ProgramResult result = testing::RunProgram(limited);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("--retry-failed"));
  std::vector<TrialRow> rows = StudyStore::Open(Path("a.sqlite")).ReadRows();
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].result.outcome, Outcome::kCrashed);
  EXPECT_EQ(rows[0].result.failure, "the process was killed from outside: Killed, 3 times");
  EXPECT_EQ(rows[1].result.outcome, Outcome::kTracked);
  const std::string before = Dump(Path("a.sqlite"));
  EXPECT_EQ(RunDexcheck(RunArguments("a.sqlite")).exit_code, 0);
  EXPECT_EQ(Dump(Path("a.sqlite")), before) << "not unless told";
  const ProgramResult retried = RunDexcheck(RunArguments("a.sqlite", {"--retry-failed"}));
  EXPECT_EQ(retried.exit_code, 0) << retried.err;
  rows = StudyStore::Open(Path("a.sqlite")).ReadRows();
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].result.outcome, Outcome::kTracked) << rows[0].result.failure;
  EXPECT_EQ(rows[0].result.metrics[kSimulatedTime], 20.0);
}

TEST_F(StudyCommand, TrialsHaveATimeLimit) {
  WriteText(folder_.path() / "tiny.toml", "trial_time_limit = 0.5\n" + kSlowStudy);
  EXPECT_EQ(RunDexcheck(RunArguments("a.sqlite")).exit_code, 0);
  const std::vector<TrialRow> rows = StudyStore::Open(Path("a.sqlite")).ReadRows();
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].result.outcome, Outcome::kTimedOut);
  EXPECT_THAT(rows[0].result.failure, HasSubstr("trial_time_limit, 0.5 s"));
  EXPECT_EQ(rows[1].result.outcome, Outcome::kTracked);
  const ProgramResult report = RunDexcheck({"study", "report", Path("a.sqlite"), "--out", "-"});
  EXPECT_EQ(report.exit_code, 0) << report.err;
  EXPECT_THAT(report.out, HasSubstr("timed out"));
}

TEST_F(StudyCommand, CtrlCEndsItInGoodOrder) {
  Program program(DexcheckCommand(RunArguments("a.sqlite", {"--jobs", "1"})), {});
  while (!std::filesystem::exists(Path("a.sqlite")))
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  program.Signal(SIGINT);
  const ProgramResult result = program.Wait();
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("interrupted"));
  EXPECT_EQ(RunDexcheck(RunArguments("a.sqlite")).exit_code, 0);
  EXPECT_EQ(Dump(Path("a.sqlite")), Reference());
}

TEST_F(StudyCommand, AFullDiskLosesNothing) {
#if defined(__has_feature)
#if __has_feature(thread_sanitizer)
  GTEST_SKIP() << "the thread sanitizer itself needs files larger than this test allows";
#endif
#endif
  ASSERT_EQ(RunDexcheck(RunArguments("a.sqlite", {"--shard", "1/2"})).exit_code, 0);
  const std::string before = Dump(Path("a.sqlite"));
  ProgramOptions full;
  full.largest_file = 4096;
  EXPECT_TRUE(IsRefused(RunDexcheck(RunArguments("a.sqlite"), full), {"a.sqlite: cannot be written"}));
  EXPECT_EQ(Dump(Path("a.sqlite")), before);
  EXPECT_EQ(RunDexcheck(RunArguments("a.sqlite")).exit_code, 0);
  EXPECT_EQ(Dump(Path("a.sqlite")), Reference());
}

// On a file system of its own, which only a process in a name space of its own may mount.
TEST_F(StudyCommand, AFullFileSystemLosesNothing) {
  const std::vector<std::string> apart = {"unshare", "--map-root-user", "--mount", "sh", "-euc"};
  const std::string mount = "mount -t tmpfs -o size=128k tmpfs \"$1\"";
  const auto run = [&](const std::string& script) {
    std::vector<std::string> command = apart;
    command.insert(command.end(), {script, "sh", folder_.path() / "disk", folder_.path() / "tiny.toml",
                                   folder_.path(), testing::ProgramPath()});
    return testing::RunProgram(command);
  };
  std::filesystem::create_directory(folder_.path() / "disk");
  if (run(mount).exit_code != 0) GTEST_SKIP() << "no file system may be mounted here";
  ASSERT_EQ(RunDexcheck(RunArguments("a.sqlite", {"--shard", "1/2"})).exit_code, 0);
  const std::string before = Dump(Path("a.sqlite"));
  const ProgramResult result = run(mount + R"(
    cp "$3/a.sqlite" "$1"
    dd if=/dev/zero of="$1/filler" bs=4k 2>"$3/dd.txt" && exit 99
    code=0
    "$4" study run "$2" --db "$1/a.sqlite" --jobs 1 || code=$?
    ls "$1" >"$3/left.txt"
    cp "$1/a.sqlite" "$3/full.sqlite"
    rm "$1/filler"
    "$4" study run "$2" --db "$1/a.sqlite" --quiet
    cp "$1/a.sqlite" "$3/freed.sqlite"
    exit $code)");
  EXPECT_TRUE(IsRefused(result, {"disk/a.sqlite: cannot be written: database or disk is full"}));
  EXPECT_EQ(testing::ReadText(Path("left.txt")), "a.sqlite\nfiller\n");
  EXPECT_EQ(Dump(Path("full.sqlite")), before);
  EXPECT_EQ(Dump(Path("freed.sqlite")), Reference());
}

TEST_F(StudyCommand, AReadOnlyDatabaseIsNamed) {
  ASSERT_EQ(RunDexcheck(RunArguments("a.sqlite", {"--shard", "1/2"})).exit_code, 0);
  const std::string before = Dump(Path("a.sqlite"));
  std::vector<std::string> command = DexcheckCommand(RunArguments("a.sqlite"));
  ::chmod(Path("a.sqlite").c_str(), 0444);
  if (::geteuid() == 0) {
    // Root may write everything; nobody may not.
    ::chmod(folder_.path().c_str(), 0755);
    command.insert(command.begin(), {"setpriv", "--reuid=65534", "--clear-groups"});
  }
  EXPECT_TRUE(IsRefused(testing::RunProgram(command), {"a.sqlite: cannot be written: it is read-only"}));
  EXPECT_EQ(Dump(Path("a.sqlite")), before);
}

TEST_F(StudyCommand, MistakesAreNamed) {
  EXPECT_TRUE(IsRefused(RunDexcheck({"study", "run", "gain", "--db", Path("a.sqlite")}),
                        {"study \"gain\"", "did you mean \"gains\"?"}));
  EXPECT_TRUE(IsRefused(RunDexcheck(RunArguments("no/a.sqlite")), {"no/a.sqlite: cannot be opened"}));
  // Nothing is thrown away: what is no file is refused, by every command.
  ASSERT_EQ(RunDexcheck(RunArguments("good.sqlite", {"--shard", "1/6"})).exit_code, 0);
  ProgramOptions here;
  here.folder = folder_.path();
  for (const std::string name : {"", ":memory:", "file:x.sqlite?mode=memory", ".", "/dev/null"}) {
    const std::string quoted = "\"" + name + "\": a database must be a plain file";
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"run", "tiny.toml", "--db", name},
          {"merge", name, "good.sqlite"},
          {"merge", "new.sqlite", name},
          {"report", name, "--out", "page.html"}}) {
      std::vector<std::string> command = {"study"};
      command.insert(command.end(), arguments.begin(), arguments.end());
      EXPECT_TRUE(IsRefused(RunDexcheck(command, here), {quoted})) << arguments[0];
    }
  }
  EXPECT_FALSE(std::filesystem::exists(Path("page.html")));
  EXPECT_FALSE(std::filesystem::exists(Path("new.sqlite")));
  for (const char* shard : {"0/2", "3/2", "1", "1/", "a/b", "1/2x"}) {
    EXPECT_TRUE(IsRefused(RunDexcheck(RunArguments("a.sqlite", {"--shard", shard})),
                          {"--shard: must be I/N with 1 <= I <= N, got \"" + std::string(shard) + "\""}));
  }
  WriteText(folder_.path() / "tiny.toml", testing::ReplaceOnce(kStudy, "control.K_v", "control.K_w"));
  EXPECT_TRUE(IsRefused(RunDexcheck(RunArguments("a.sqlite")), {"control.K_w: unknown key, did you mean"}));
  EXPECT_FALSE(std::filesystem::exists(Path("a.sqlite"))) << "nothing was begun";
}

TEST_F(StudyCommand, TheReportsCommandsRepeatTheTrials) {
  ASSERT_EQ(RunDexcheck(RunArguments("a.sqlite", {"--quiet"})).exit_code, 0);
  const ProgramResult report = RunDexcheck({"study", "report", Path("a.sqlite"), "--out", "-"});
  ASSERT_EQ(report.exit_code, 0) << report.err;
  EXPECT_THAT(report.out, ::testing::StartsWith("<!DOCTYPE html>"));
  EXPECT_THAT(report.out, ::testing::EndsWith("</html>\n"));
  EXPECT_THAT(report.out, HasSubstr("tell 6 of 6 trials rightly"));
  const std::string mark = "id=\"trial-4\"";
  const size_t begin = report.out.find("dexcheck run", report.out.find(mark));
  // As a browser shows it.
  std::string shown = report.out.substr(begin, report.out.find("</pre>", begin) - begin);
  const std::string quote = "&#39;";
  for (size_t at = shown.find(quote); at != std::string::npos; at = shown.find(quote)) {
    shown.replace(at, quote.size(), "'");
  }
  EXPECT_THAT(shown, HasSubstr("--set control.K_p=10000 --set control.K_v=200"));
  const std::filesystem::path program = testing::ProgramPath();
  ProgramOptions options;
  options.folder = folder_.path();
  options.environment = {{"PATH", program.parent_path().string() + ":" + ::getenv("PATH")}};
  const ProgramResult replay = testing::RunProgram({"sh", "-c", shown}, options);
  EXPECT_EQ(replay.exit_code, 0) << replay.err;
  EXPECT_EQ(testing::ReadText(folder_.path() / "trial-4/video.mp4").substr(4, 4), "ftyp");
  // The same number, bit for bit.
  const auto summary = nlohmann::json::parse(testing::ReadText(folder_.path() / "trial-4/summary.json"));
  const std::vector<TrialRow> rows = StudyStore::Open(Path("a.sqlite")).ReadRows();
  EXPECT_EQ(summary["tracking"]["position_error_rms_m"].get<double>(),
            rows[4].result.metrics[kPositionErrorRms]);
}

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
    const ProgramResult result = testing::RunProgram({"bash", "job.sh"}, options);
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
    WriteText(folder_.path() / "tiny.toml", testing::ReplaceOnce(kStudy, from, to));
    const ProgramResult run = RunDexcheck(RunArguments("a.sqlite"));
    const ProgramResult printed = slurm({});
    EXPECT_TRUE(IsRefused(printed, {}));
    EXPECT_EQ(printed.err, run.err);
  }
}

}  // namespace
}  // namespace dexcheck
