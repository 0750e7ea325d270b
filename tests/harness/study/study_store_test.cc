// The database of a study: what it keeps, what it refuses.

#include "harness/study/study_store.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <limits>

#include "controller/common/errors.h"
#include "harness/study/process_name.h"
#include "tests/common/files.h"
#include "tests/common/throws.h"

namespace dexcheck {
namespace {

using testing::TempFolder;
using testing::Throws;

const std::string kText =
    "name = \"s\"\nscenario = \"hold\"\n[[vary]]\nkey = \"control.K_p\"\nvalues = [1, 2, 3]\n";

class StudyStoreTest : public ::testing::Test {
 protected:
  StudyStoreTest() {
    study_ = ParseStudy(kText, "study.toml");
    identity_ = {{"layout", "1"},           {"name", "s"},        {"study", study_.text},
                 {"scenario", "text"},      {"robot", "text"},    {"mjcf_hash", "0"},
                 {"dexcheck_version", "1"}, {"git_revision", ""}, {"mujoco_version", "2"}};
  }

  [[nodiscard]] StudyStore Open() const {
    return StudyStore::OpenOrCreate(folder_.path() / "s.sqlite", identity_, study_);
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

  TempFolder folder_;
  Study study_;
  StudyIdentity identity_;
};

TEST_F(StudyStoreTest, RowsComeBackBitForBit) {
  const TrialRow row = MakeRow(2);
  {
    StudyStore store = Open();
    store.Add(MakeRow(3));
    store.Add(row);
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
  EXPECT_TRUE(store.Has(3));
  EXPECT_FALSE(store.Has(1));
}

TEST_F(StudyStoreTest, AnotherStudyIsRefused) {
  { const StudyStore made = Open(); }
  for (auto& [column, value] : identity_) {
    if (column == "layout" || column == "study") continue;
    const std::string before = std::exchange(value, "other");
    EXPECT_TRUE(Throws<InputError>([&] { return Open(); }, "is of another study: " + column + " differs"));
    value = before;
  }
  EXPECT_NO_THROW({ const StudyStore same = Open(); });
}

TEST_F(StudyStoreTest, OtherFilesAreRefused) {
  const std::filesystem::path path = folder_.path() / "s.sqlite";
  testing::WriteText(path, std::string(5000, 'x'));
  EXPECT_TRUE(Throws<InputError>([&] { return Open(); }, "s.sqlite: is not a usable database"));
  std::filesystem::remove(path);
  Database(path, Database::Mode::kCreate).Execute("CREATE TABLE other (x)");
  EXPECT_TRUE(Throws<InputError>([&] { return Open(); }, "s.sqlite: is not the database of a study"));
  EXPECT_TRUE(
      Throws<InputError>([&] { return StudyStore::Open(folder_.path() / "no.sqlite"); }, "cannot be opened"));
}

TEST_F(StudyStoreTest, DifferentResultsOfOneTrialAreRefused) {
  StudyStore store = Open();
  store.AddAll({MakeRow(0), MakeRow(1)}, "a.sqlite");
  store.AddAll({MakeRow(1), MakeRow(2)}, "b.sqlite");
  EXPECT_EQ(store.ReadRows().size(), 3u);
  TrialRow other = MakeRow(2);
  other.result.metrics[kEnergy] = std::nextafter(other.result.metrics[kEnergy], 1.0);
  EXPECT_TRUE(Throws<InputError>(
      [&] {
        store.AddAll({MakeRow(5), other}, "c.sqlite");
        return 0;
      },
      "c.sqlite: trial 2 has another result"));
  EXPECT_FALSE(store.Has(5)) << "all or nothing";
}

TEST_F(StudyStoreTest, AClaimHoldsAsLongAsItsProcessLives) {
  StudyStore store = Open();
  EXPECT_TRUE(store.Claim(1));
  EXPECT_FALSE(Open().Claim(1));
  store.Release(1);
  EXPECT_TRUE(store.Claim(1));
  store.Add(MakeRow(1));
  EXPECT_FALSE(store.Claim(1)) << "done";

  const pid_t child = ::fork();
  if (child == 0) ::_exit(Open().Claim(2) ? 0 : 1);
  int status = -1;
  ::waitpid(child, &status, 0);
  ASSERT_EQ(status, 0);
  EXPECT_TRUE(store.Claim(2)) << "its process is gone";
}

TEST(ProcessName, KnowsTheLiving) {
  EXPECT_TRUE(IsRunningHere(NameThisProcess()));
  EXPECT_FALSE(IsRunningHere(NameThisProcess() + "1")) << "another start";
  EXPECT_FALSE(IsRunningHere("elsewhere/" + NameThisProcess()));
  EXPECT_FALSE(IsRunningHere(""));
}

}  // namespace
}  // namespace dexcheck
