// A study that was edited keeps the rows that it still means.

#include <gtest/gtest.h>

#include "controller/common/errors.h"
#include "harness/study/study_store.h"
#include "tests/common/files.h"
#include "tests/common/throws.h"
#include "tests/harness/study/study_fixture.h"

namespace dexcheck::testing::study_change_test {
namespace {

const std::string kText = R"(name = "s"
scenario = "hold"
seeds = [3, 4]
[[vary]]
key = "a"
values = [1, 2, 3]
[[vary]]
key = "law"
values = ["x", "y"]
)";

/// A row whose energy says which trial it is.
TrialRow MakeRow(const Study& study, const Trial& trial) {
  TrialRow row = MakeTrialRow(trial);
  row.result.metrics[kEnergy] = 100.0 * trial.parameters[0] + static_cast<double>(trial.seed) +
                                (FormatValue(study.variations[1], trial.parameters[1]) == "x" ? 0.5 : 0.25);
  return row;
}

class StudyChangeTest : public ::testing::Test {
 protected:
  StudyStore Open(const std::string& text, const std::string& revision = "r1",
                  const MakesSameRows& same = {}) {
    const Study study = ParseStudy(text, "study.toml");
    StudyIdentity identity = MakeIdentity(study);
    for (auto& [column, value] : identity) {
      if (column == "git_revision") value = revision;
    }
    return StudyStore::OpenOrCreate(folder_.path() / "s.sqlite", identity, study, same);
  }

  void Fill(const std::string& text) {
    StudyStore store = Open(text);
    for (const Trial& trial : ListTrials(store.study())) store.Add(MakeRow(store.study(), trial));
  }

  /// Each row has the metrics of the trial that it is now.
  static void ExpectRightRows(const StudyStore& store, size_t count) {
    const std::vector<TrialRow> rows = store.ReadRows();
    EXPECT_EQ(rows.size(), count);
    const std::vector<Trial> trials = ListTrials(store.study());
    for (const TrialRow& row : rows) {
      const Trial& trial = trials.at(static_cast<size_t>(row.trial.number));
      EXPECT_EQ(row.trial.seed, trial.seed);
      EXPECT_EQ(row.trial.parameters, trial.parameters);
      EXPECT_EQ(row.result.metrics[kEnergy], MakeRow(store.study(), trial).result.metrics[kEnergy]);
    }
  }

  TempFolder folder_;
};

TEST_F(StudyChangeTest, ACommentIsNoChange) {
  Fill(kText);
  const std::string edited =
      "# why\n" + ReplaceOnce(kText, "name = \"s\"", "name = \"other\"\ndescription = \"d\"");
  {
    const StudyStore store = Open(edited);
    EXPECT_EQ(store.change(), "");
    ExpectRightRows(store, 12);
  }
  EXPECT_EQ(StudyStore::Open(folder_.path() / "s.sqlite").study().name, "other") << "and the file says so";
}

TEST_F(StudyChangeTest, RowsThatAreStillMeantAreKeptWhateverTheirNumber) {
  Fill(kText);
  // One value goes, one comes; the texts and the keys change places; a seed comes.
  const std::string edited = R"(name = "s"
scenario = "hold"
seeds = [9, 4, 3]
[[vary]]
key = "a"
values = [3, 1.5, 1]
[[vary]]
key = "law"
values = ["z", "y", "x"]
)";
  {
    const StudyStore store = Open(edited);
    EXPECT_EQ(store.change(), "the study was edited: 8 trials are kept, 4 are set aside");
    ExpectRightRows(store, 8);
  }
  // Edited back: what was set aside is there again.
  const StudyStore store = Open(kText);
  EXPECT_EQ(store.change(), "the study was edited: 8 trials are kept, 4 are brought back");
  ExpectRightRows(store, 12);
}

TEST_F(StudyChangeTest, KeysMayChangePlaces) {
  Fill(kText);
  const std::string law = "[[vary]]\nkey = \"law\"\nvalues = [\"x\", \"y\"]\n";
  const std::string edited =
      ReplaceOnce(ReplaceOnce(kText, law, ""), "[[vary]]\nkey = \"a\"", law + "[[vary]]\nkey = \"a\"");
  const StudyStore store = Open(edited);
  EXPECT_EQ(store.change(), "the study was edited: 12 trials are kept");
  for (const TrialRow& row : store.ReadRows()) {
    EXPECT_EQ(row.result.metrics[kEnergy], 100.0 * row.trial.parameters[1] +
                                               static_cast<double>(row.trial.seed) +
                                               (row.trial.parameters[0] == 0.0 ? 0.5 : 0.25));
  }
}

TEST_F(StudyChangeTest, OtherTrialsAreRefused) {
  Fill(kText);
  for (const auto& [from, to, what] : {std::tuple{"scenario = \"hold\"", "scenario = \"offset\"", "scenario"},
                                       {"seeds", "set = [\"duration=1\"]\nseeds", "set"},
                                       {"seeds", "check = true\nseeds", "check"},
                                       {"seeds", "stop_error = 1\nseeds", "stop_error"},
                                       {"\"law\"", "\"lawn\"", "keys of vary"}}) {
    EXPECT_TRUE(Throws<InputError>([&, f = from, t = to] { return Open(ReplaceOnce(kText, f, t)); },
                                   std::string("is of another study: study differs: ") + what));
  }
  ExpectRightRows(Open(kText), 12);
}

TEST_F(StudyChangeTest, ASearchMayOnlyGrow) {
  const std::string search =
      "name = \"s\"\nscenario = \"hold\"\n[[objective]]\nminimize = \"energy\"\n[search]\nmethod = "
      "\"cma_es\"\ncount = 32\n[[vary]]\nkey = \"a\"\nfrom = 0\nto = 1\n";
  { const StudyStore store = Open(search); }
  EXPECT_NO_THROW({ const StudyStore store = Open(ReplaceOnce(search, "32", "64")); });
  EXPECT_TRUE(Throws<InputError>([&] { return Open(ReplaceOnce(search, "energy", "overshoot")); },
                                 "study differs: objective"));
  EXPECT_TRUE(Throws<InputError>([&] { return Open(ReplaceOnce(search, "32", "32\nseed = 3")); },
                                 "study differs: search"));
  EXPECT_TRUE(Throws<InputError>([&] { return Open(ReplaceOnce(search, "to = 1", "to = 2")); },
                                 "study differs: vary"));
}

TEST_F(StudyChangeTest, AnotherRevisionGoesOnWhenItMakesTheSameRows) {
  Fill(kText);
  EXPECT_TRUE(Throws<InputError>([&] { return Open(kText, "r2"); }, "git_revision differs"));
  EXPECT_TRUE(Throws<InputError>(
      [&] { return Open(kText, "r2", [](const std::vector<TrialRow>&) { return false; }); },
      "git_revision differs"));
  {
    const StudyStore store =
        Open(kText, "r2", [](const std::vector<TrialRow>& rows) { return rows.size() == 12; });
    EXPECT_EQ(store.change(), "its rows are of another revision, which made the same ones");
  }
  EXPECT_EQ(Open(kText, "r2").change(), "");
}

}  // namespace
}  // namespace dexcheck::testing::study_change_test
