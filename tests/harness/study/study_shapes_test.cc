// Every shape of study has its page, its progress, its CSV; a database that was spoiled is refused in one
// line.

#include <SQLiteCpp/Database.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "harness/study/search.h"
#include "harness/study/study_findings.h"
#include "tests/common/files.h"
#include "tests/common/matchers.h"
#include "tests/harness/study/study_fixture.h"

namespace dexcheck::testing::study_shapes_test {
namespace {

struct Shape {
  std::string name;
  std::string text;  ///< Text of the study after its name and scenario.
};

std::string Vary(const std::string& key, const std::string& values) {
  return "[[vary]]\nkey = '" + key + "'\n" + values + "\n";
}

const std::string kHeld = "constraints = ['held']\n";
const std::string kRange = "from = 5\nto = 50";
const std::string kOne = Vary("control.K_p", "values = [100, 1e3, 1e4]");
const std::string kTwo = kOne + Vary("control.K_v", "values = [20, 200]");
const std::string kText = Vary("control.law", "values = ['computed_torque', 'pd_gravity']");
const std::string kRanges = Vary("control.K_p", kRange) + Vary("control.K_v", kRange);
const std::string kWish = "[[objective]]\nminimize = 'energy'\n";

std::string Search(const std::string& method) {
  return "[search]\nmethod = '" + method + "'\ncount = 40\nseed = 1\n";
}

std::string Sample(const std::string& method) {
  return "[sample]\nmethod = '" + method + "'\ncount = 8\nseed = 1\n";
}

const std::vector<Shape> kShapes = {
    {"OneKey", kOne},
    {"TwoKeys", kTwo},
    {"ThreeKeys", kTwo + Vary("plant.finger_friction", "values = [0.5, 1]")},
    {"OneKeySeeds", "seeds = [1, 2, 3]\n" + kOne},
    {"OneText", kText},
    {"TextSeeds", "seeds = [1, 2]\n" + kText},
    {"TextAndNumber", kOne + kText},
    {"Truths", Vary("plant.implicit_damping", "values = [true, false]")},
    {"Lists", Vary("control.K_p", "values = [[1, 1, 1, 1, 1, 1], [2, 2, 2, 2, 2, 2]]")},
    {"Count", Vary("control.K_p", kRange + "\ncount = 4")},
    {"Latin", Sample("latin_hypercube") + kRanges},
    {"LatinOneKey", Sample("latin_hypercube") + Vary("control.K_p", kRange)},
    {"LatinText", Sample("latin_hypercube") + kText},
    {"Sobol", Sample("sobol") + kRanges},
    {"Random", kHeld + Sample("random") + kRanges},
    {"Morris", Sample("morris") + kRanges},
    {"CmaEs", Search("cma_es") + kWish + kRanges},
    {"CmaEsSeeds", "seeds = [1, 2]\n" + Search("cma_es") + kWish + kRanges},
    {"NelderMead", Search("nelder_mead") + kWish + kRanges},
    {"NelderMeadOneKey", Search("nelder_mead") + kWish + Vary("control.K_p", kRange)},
    {"GridWithWish", kWish + kTwo},
    {"GridWithTwoWishes", kWish + "[[objective]]\nmaximize = 'cone_margin'\n" + kTwo},
};

TrialRow MakeRow(const Trial& trial) {
  TrialRow row = MakeTrialRow(trial, 1.0 / static_cast<double>(trial.number + 1));
  if (trial.number % 3 == 2) row.result.outcome = Outcome::kDiverged;
  row.machine = "=cmd|calc";
  return row;
}

class StudyShapes : public ::testing::TestWithParam<Shape> {
 protected:
  /// A study with all its trials; of a search with those of its first batches.
  StudyStore Make(const std::string& text) {
    const StudyInputs inputs = MakeStudyInputs("name = 'shape'\nscenario = 'offset'\n" + text);
    const Study& study = inputs.study;
    StudyStore store = StudyStore::OpenOrCreate(path(), IdentifyStudy(inputs), study);
    if (!study.is_search()) {
      for (const Trial& trial : ListTrials(study)) store.Add({MakeRow(trial)});
      return store;
    }
    constexpr int kBatches = 3;
    SearchHistory history(study);
    for (int i = 0; i < kBatches; ++i) {
      for (const Trial& trial : history.ListMissing()) {
        store.Add({MakeRow(trial)});
        history.Add(MakeRow(trial));
      }
    }
    EXPECT_EQ(history.CountDone(), static_cast<long>(store.ListNumbers().size()));
    return store;
  }

  [[nodiscard]] std::filesystem::path path() const { return folder_.path() / "s.sqlite"; }
  void Spoil(const std::string& sql) const { SQLite::Database(path(), SQLite::OPEN_READWRITE).exec(sql); }

  TempFolder folder_;
};

TEST_P(StudyShapes, HasItsPageItsProgressAndItsCsv) {
  const StudyStore store = Make(GetParam().text);
  const size_t count = store.ListNumbers().size();
  ASSERT_GT(count, 0U);
  const StudySummary summary = SummariseStudy(store);
  EXPECT_EQ(summary.json["done"], count);
  EXPECT_EQ(summary.values.size(), count * summary.json["columns"].size() * sizeof(double));
  EXPECT_THAT(MakeStudyPage(summary), HasSubstr("id=\"study-data\""));
  EXPECT_THAT(DescribeProgress(store), HasSubstr("shape: " + std::to_string(count) + " of "));
  std::string csv;
  WriteStudyCsv(store, [&](std::string_view text) { csv += text; });
  EXPECT_EQ(std::ranges::count(csv, '\n'), static_cast<std::ptrdiff_t>(count) + 1);
  EXPECT_THAT(csv, HasSubstr(",\"'=cmd|calc\"\n")) << "no formula for a spreadsheet";
}

INSTANTIATE_TEST_SUITE_P(All, StudyShapes, ::testing::ValuesIn(kShapes),
                         [](const auto& info) { return info.param.name; });

class StudyPage : public StudyShapes {};

TEST_F(StudyPage, RefusesASpoiledDatabaseByTrialAndKey) {
  const StudyStore store = Make(kText);
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"\"control.law\" = 'unknown'", "trial 1: control.law: must be a number, got \"unknown\""},
      {"\"control.law\" = 7", "trial 1: control.law: must be a whole number from 0 to 1, got \"7.0\""},
      {"\"control.law\" = 0.5", "trial 1: control.law: must be a whole number from 0 to 1, got \"0.5\""},
      {"\"control.law\" = 1, energy = 'much'", "trial 1: energy: must be a number, got \"much\""}};
  for (const auto& [set, message] : cases) {
    Spoil("UPDATE trials SET " + set + " WHERE trial = 1");
    try {
      SummariseStudy(StudyStore::Open(path()));
      ADD_FAILURE() << set;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(message));
    }
  }
}

/// Numbers of the trials in the table of the best.
std::vector<long> ListBest(const nlohmann::ordered_json& best) {
  std::vector<long> trials;
  for (const auto& row : best["rows"]) trials.push_back(row["trial"]);
  return trials;
}

TEST_F(StudyPage, BestIsByTheObjectiveAmongWhatTheConstraintsAdmit) {
  // Metrics fall with the number; each third trial is no candidate.
  const auto best = [&](const std::string& constraint, const std::string& wish) {
    std::filesystem::remove(path());
    return SummariseStudy(Make("constraints = ['" + constraint + "']\n" + wish + kTwo)).json["best"];
  };
  const auto largest = best("energy < 0.6", "[[objective]]\nmaximize = 'energy'\n");
  EXPECT_THAT(largest["order"].get<std::string>(), HasSubstr("By the largest energy"));
  EXPECT_EQ(ListBest(largest), (std::vector<long>{1, 3, 4}));
  EXPECT_EQ(largest["rows"][0]["cells"], (std::vector<double>{100.0, 200.0, 0.5})) << "K_p, K_v, energy";
  EXPECT_EQ(ListBest(best("energy < 0", kWish)), std::vector<long>());
  EXPECT_THAT(ListBest(best("energy > 0.3", "")), ::testing::UnorderedElementsAre(0, 1));
  // Two contradicting objectives have all in the front; two that agree have one.
  const std::string two = kWish + "[[objective]]\nmaximize = 'overshoot'\n";
  EXPECT_EQ(ListBest(best("held", two)), (std::vector<long>{4, 3, 1, 0}));
  EXPECT_EQ(ListBest(best("held", kWish + "[[objective]]\nminimize = 'overshoot'\n")), std::vector<long>{4});
}

}  // namespace
}  // namespace dexcheck::testing::study_shapes_test
