// The database of a study: what it keeps, what it refuses.

#include "harness/study/study_store.h"

#include <SQLiteCpp/Database.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <limits>

#include "controller/common/errors.h"
#include "tests/common/files.h"
#include "tests/common/throws.h"
#include "tests/harness/study/study_fixture.h"

namespace dexcheck::testing::study_store_test {
namespace {

const std::string kText =
    "name = \"s\"\nscenario = \"hold\"\n[[vary]]\nkey = \"control.K_p\"\nvalues = [1, 2, 3]\n";

class StudyStoreTest : public ::testing::Test {
 protected:
  StudyStoreTest() {
    study_ = ParseStudy(kText, "study.toml");
    identity_ = MakeIdentity(study_);
  }

  [[nodiscard]] StudyStore Open() const {
    return StudyStore::OpenOrCreate(folder_.path() / "s.sqlite", identity_, study_);
  }
  /// With another text of the study, by another revision of the program.
  [[nodiscard]] StudyStore Open(const std::string& text, const std::string& revision = "text",
                                const MakesSameRows& same = {}) const {
    const Study study = ParseStudy(text, "study.toml");
    StudyIdentity identity = MakeIdentity(study);
    for (auto& [column, value] : identity) {
      if (column == "git_revision") value = revision;
    }
    return StudyStore::OpenOrCreate(folder_.path() / "s.sqlite", identity, study, same);
  }

  void Execute(const std::string& sql) const {
    SQLite::Database(folder_.path() / "s.sqlite", SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE).exec(sql);
  }

  [[nodiscard]] static TrialRow MakeRow(long number) {
    TrialRow row;
    row.trial = {number, 4, {0.1 + static_cast<double>(number)}};
    row.result.outcome = Outcome::kSlipped;
    row.result.failure = "it's \"so\"";
    for (size_t i = 0; i < kNumMetrics; ++i) row.result.metrics[i] = 1.0 / static_cast<double>(i + 3);
    row.result.metrics[kSettlingTime] = std::numeric_limits<double>::quiet_NaN();
    return row;
  }

  static TrialSource MakeSource(const std::string& name, const std::vector<TrialRow>& rows) {
    return {name, [rows](const std::function<void(TrialRow &&)>& take) {
              for (const TrialRow& row : rows) take(TrialRow(row));
            }};
  }

  TempFolder folder_;
  Study study_;
  StudyIdentity identity_;
};

TEST_F(StudyStoreTest, RowsComeBackBitForBit) {
  const TrialRow row = MakeRow(2);
  {
    StudyStore store = Open();
    store.Add({MakeRow(3)});
    store.Add({row});
  }
  const StudyStore store = StudyStore::Open(folder_.path() / "s.sqlite");
  const std::vector<TrialRow> rows = store.ReadRows();
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].trial.number, 2);
  EXPECT_EQ(rows[0].trial.seed, 4u);
  EXPECT_EQ(rows[0].trial.parameters, row.trial.parameters);
  EXPECT_EQ(rows[0].result.outcome, row.result.outcome);
  EXPECT_EQ(rows[0].result.failure, row.result.failure);
  for (size_t i = 0; i < kNumMetrics; ++i) {
    if (i == kSettlingTime) {
      EXPECT_TRUE(std::isnan(rows[0].result.metrics[i]));
    } else {
      EXPECT_EQ(rows[0].result.metrics[i], row.result.metrics[i]);
    }
  }
  EXPECT_EQ(store.identity(), identity_);
  EXPECT_TRUE(store.FindRow(3));
  EXPECT_FALSE(store.FindRow(1));
}

TEST_F(StudyStoreTest, AnotherStudyIsRefused) {
  { const StudyStore made = Open(); }
  for (auto& [column, value] : identity_) {
    if (column == "layout" || column == "study" || column == "name") continue;
    const std::string before = std::exchange(value, "other");
    EXPECT_TRUE(Throws<InputError>([&] { return Open(); }, "is of another study: " + column + " differs"));
    value = before;
  }
  EXPECT_NO_THROW({ const StudyStore same = Open(); });
}

// Texts that change no trial may be edited.
TEST_F(StudyStoreTest, TheDatabaseTakesOverWhatNoRowDependsOn) {
  Open().Add({MakeRow(0)});
  const std::string edited =
      ReplaceOnce(ReplaceOnce(kText, "\"s\"", "\"other\""), "[[vary]]",
                  "# why\ndescription = 'd'\ntrial_time_limit = 3\nmetrics = ['energy']\n"
                  "constraints = ['held']\n[[objective]]\nminimize = 'energy'\n[[vary]]");
  { const StudyStore store = Open(edited); }
  const StudyStore store = StudyStore::Open(folder_.path() / "s.sqlite");
  EXPECT_EQ(store.study().name, "other");
  EXPECT_EQ(store.study().trial_time_limit, 3.0);
  EXPECT_EQ(store.study().objectives.size(), 1U);
  EXPECT_EQ(store.ReadRows().size(), 1U);
}

TEST_F(StudyStoreTest, AnEditedStudyIsRefusedByItsKey) {
  Open().Add({MakeRow(0)});
  for (const auto& [from, to, key] : {std::tuple{"\"hold\"", "\"offset\"", "scenario"},
                                      {"[[", "controller = \"law.py\"\n[[", "controller"},
                                      {"[[", "set = [\"duration=1\"]\n[[", "set"},
                                      {"[1, 2, 3]", "[1, 2, 3, 4]", "vary"},
                                      {"[[", "[sample]\nmethod = \"random\"\ncount = 3\n[[", "sample"},
                                      {"[[", "seeds = [1]\n[[", "seeds"},
                                      {"[[", "check = true\n[[", "check"},
                                      {"[[", "stop_error = 1\n[[", "stop_error"},
                                      {"[[", "metrics = [\"gain_margin\"]\n[[", "metrics"},
                                      {"[[", "constraints = [\"gain_margin > 2\"]\n[[", "constraints"}}) {
    EXPECT_TRUE(Throws<InputError>([&, f = from, t = to] { return Open(ReplaceOnce(kText, f, t)); },
                                   std::string("s.sqlite: is of another study: key ") + key +
                                       " differs; each study needs a database file of its own"));
  }
  EXPECT_EQ(Open().ReadRows().size(), 1U);
}

// Its points follow from what it looks for.
TEST_F(StudyStoreTest, AnEditedSearchIsRefused) {
  const std::string search =
      "name = \"s\"\nscenario = \"hold\"\n[[objective]]\nminimize = \"energy\"\n[search]\nmethod = "
      "\"cma_es\"\ncount = 32\n[[vary]]\nkey = \"a\"\nfrom = 0\nto = 1\n";
  { const StudyStore store = Open(search); }
  for (const auto& [from, to, key] : {std::tuple{"32", "64", "search"},
                                      {"energy", "overshoot", "objective"},
                                      {"[[obj", "constraints = [\"held\"]\n[[obj", "constraints"},
                                      {"to = 1", "to = 2", "vary"}}) {
    EXPECT_TRUE(Throws<InputError>([&, f = from, t = to] { return Open(ReplaceOnce(search, f, t)); },
                                   std::string("key ") + key + " differs"));
  }
}

TEST_F(StudyStoreTest, AnotherRevisionGoesOnWhenItMakesTheSameRows) {
  Open().Add({MakeRow(0)});
  EXPECT_TRUE(Throws<InputError>([&] { return Open(kText, "r2"); }, "git_revision differs"));
  EXPECT_TRUE(Throws<InputError>(
      [&] { return Open(kText, "r2", [](const std::vector<TrialRow>&) { return false; }); },
      "git_revision differs"));
  {
    const StudyStore store =
        Open(kText, "r2", [](const std::vector<TrialRow>& rows) { return rows.size() == 1; });
    EXPECT_EQ(store.change(), "its rows are of another revision, which made the same ones");
  }
  EXPECT_EQ(Open(kText, "r2").change(), "");
}

// Earlier versions kept rows of an edited study under negative numbers.
TEST_F(StudyStoreTest, RowsThatWereSetAsideCountNowhere) {
  Open().Add({MakeRow(0)});
  Open().Add({MakeRow(-1)});
  const StudyStore store = StudyStore::Open(folder_.path() / "s.sqlite");
  EXPECT_EQ(store.ListNumbers(), std::vector<long>{0});
  EXPECT_EQ(store.ReadRows().size(), 1U);
  EXPECT_EQ(store.CountOutcomes().at(Outcome::kSlipped), 1);
}

TEST_F(StudyStoreTest, OtherFilesAreRefused) {
  const std::filesystem::path path = folder_.path() / "s.sqlite";
  WriteText(path, std::string(5000, 'x'));
  EXPECT_TRUE(Throws<InputError>([&] { return Open(); }, "s.sqlite: is not a usable database"));
  std::filesystem::remove(path);
  Execute("CREATE TABLE other (x)");
  EXPECT_TRUE(Throws<InputError>([&] { return Open(); }, "s.sqlite: is not the database of a study"));
  EXPECT_TRUE(
      Throws<InputError>([&] { return StudyStore::Open(folder_.path() / "no.sqlite"); }, "cannot be opened"));
}

TEST_F(StudyStoreTest, BetweenMachinesResultsAreTheSameWithinRounding) {
  TrialRow row = MakeRow(0);
  row.result.failure.clear();
  TrialRow other = row;
  for (double& metric : other.result.metrics) metric *= 1.0 + 1e-12;
  EXPECT_FALSE(IsSame(row, other)) << "bit for bit on one machine";
  other.machine = "another";
  EXPECT_TRUE(IsSame(row, other));
  for (size_t i = 0; i < kNumMetrics; ++i) {
    if (i == kSettlingTime) continue;
    TrialRow wrong = other;
    wrong.result.metrics[i] += 1e-8;
    EXPECT_FALSE(IsSame(row, wrong)) << i;
    wrong.result.metrics[i] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(IsSame(row, wrong)) << i;
  }
  TrialRow wrong = other;
  wrong.result.outcome = Outcome::kTracked;
  EXPECT_FALSE(IsSame(row, wrong));
  wrong = other;
  wrong.trial.seed = 5;
  EXPECT_FALSE(IsSame(row, wrong));
  wrong = other;
  wrong.trial.parameters[0] = 7.0;
  EXPECT_FALSE(IsSame(row, wrong));
  // A run that failed amplified its rounding until then.
  TrialRow later = other;
  later.result.failure = "it fell at t = 2.001 s";
  later.result.metrics[kEnergy] *= 2.0;
  EXPECT_FALSE(IsSame(row, later)) << "one of them came to its end";
  row.result.failure = "it fell at t = 2 s";
  EXPECT_TRUE(IsSame(row, later));
}

TEST_F(StudyStoreTest, FailedTrialsGiveWay) {
  for (const Outcome failed : {Outcome::kCrashed, Outcome::kTimedOut}) {
    TrialRow crashed = MakeRow(0);
    crashed.result.outcome = failed;
    std::filesystem::remove(folder_.path() / "s.sqlite");
    StudyStore store = Open();
    store.AddAll({MakeSource("a.sqlite", {crashed}), MakeSource("b.sqlite", {MakeRow(0)}),
                  MakeSource("c.sqlite", {crashed})});
    ASSERT_EQ(store.ReadRows().size(), 1u);
    EXPECT_EQ(store.ReadRows()[0].result.outcome, Outcome::kSlipped);

    crashed.trial.number = 1;
    store.Add({crashed});
    store.RemoveFailed();
    EXPECT_TRUE(store.FindRow(0));
    EXPECT_FALSE(store.FindRow(1));
    EXPECT_FALSE(store.Claim({1}).empty());
  }
}

TEST_F(StudyStoreTest, DatabasesThatDoNotTellTheMachineAreReadAndContinued) {
  const std::filesystem::path path = folder_.path() / "s.sqlite";
  Open().Add({MakeRow(0)});
  Execute("ALTER TABLE trials DROP COLUMN machine");
  Execute("UPDATE study SET layout = '1'");
  TrialRow row = MakeRow(1);
  row.machine = "this";
  Open().Add({row});
  const std::vector<TrialRow> rows = StudyStore::Open(path).ReadRows();
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].machine, "");
  EXPECT_EQ(rows[0].result.metrics[kEnergy], MakeRow(0).result.metrics[kEnergy]);
  EXPECT_EQ(rows[1].machine, "this");
  Execute("UPDATE study SET layout = '0'");
  EXPECT_TRUE(Throws<InputError>([&] { return StudyStore::Open(path); }, "another version of dexcheck"));
}

TEST_F(StudyStoreTest, DatabasesWithoutTheNewestMetricsAreReadAndContinued) {
  const std::filesystem::path path = folder_.path() / "s.sqlite";
  Open().Add({MakeRow(0)});
  for (const char* name : {"joint_error_rms", "joint_error_max"})
    Execute(std::string("ALTER TABLE trials DROP COLUMN ") + name);
  Open().Add({MakeRow(1)});
  const std::vector<TrialRow> rows = StudyStore::Open(path).ReadRows();
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_TRUE(std::isnan(rows[0].result.metrics[kJointErrorRms]));
  EXPECT_EQ(rows[0].result.metrics[kSimulatedTime], MakeRow(0).result.metrics[kSimulatedTime]);
  EXPECT_EQ(rows[1].result.metrics[kJointErrorRms], MakeRow(1).result.metrics[kJointErrorRms]);
}

// Rows in what SQLite keeps in memory, or in a temporary file, are gone with the process.
TEST_F(StudyStoreTest, OnlyPlainFilesAreDatabases) {
  std::filesystem::create_directory(folder_.path() / "folder");
  for (const std::string& name :
       {std::string(), std::string(":memory:"), std::string(":other"), std::string("file:s?mode=memory"),
        std::string("file:s.sqlite"), std::string("file::memory:"), std::string("/dev/null"),
        (folder_.path() / "folder").string()}) {
    const std::string message = "a database must be a plain file";
    EXPECT_TRUE(
        Throws<InputError>([&] { return StudyStore::OpenOrCreate(name, identity_, study_); }, message))
        << name;
    EXPECT_TRUE(Throws<InputError>([&] { return StudyStore::Open(name); }, message)) << name;
  }
}

TEST_F(StudyStoreTest, AClaimHoldsAsLongAsItsProcessLives) {
  StudyStore store = Open();
  EXPECT_FALSE(store.Claim({1}).empty());
  EXPECT_TRUE(Open().Claim({1}).empty());
  store.Release({1});
  EXPECT_FALSE(store.Claim({1}).empty());
  store.Add({MakeRow(1)});
  EXPECT_TRUE(store.Claim({1}).empty()) << "done";

  const pid_t child = ::fork();
  if (child == 0) ::_exit(Open().Claim({2}).empty() ? 1 : 0);
  int status = -1;
  ::waitpid(child, &status, 0);
  ASSERT_EQ(status, 0);
  EXPECT_FALSE(store.Claim({2}).empty()) << "its process is gone";
}

TEST(ProcessName, KnowsTheLiving) {
  EXPECT_TRUE(IsRunningHere(NameThisProcess()));
  EXPECT_FALSE(IsRunningHere(NameThisProcess() + "1")) << "another start";
  EXPECT_FALSE(IsRunningHere("elsewhere/" + NameThisProcess()));
  EXPECT_FALSE(IsRunningHere(""));
}

}  // namespace
}  // namespace dexcheck::testing::study_store_test
