// Data of a study for its page and `report --json`, from a database of unknown origin.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "harness/study/study_findings.h"
#include "tests/common/files.h"
#include "tests/common/matchers.h"
#include "tests/harness/study/study_fixture.h"

namespace dexcheck::testing::study_summary_test {
namespace {

const std::string kMarkup = "</script><img src=x onerror=\"alert(1)\">";

Study Parse(const std::string& text) {
  return ParseStudy("name = \"page\"\nscenario = 'offset'\n" + text, "study.toml");
}

const std::string kGrid =
    "[[vary]]\nkey = 'control.K_p'\nvalues = [1, 2]\n[[vary]]\nkey = 'control.K_v'\nvalues = [20, 200]\n";

/// Summarises a database with one text in all columns, except the study itself and its scenario.
/// @param of_joints its trials have errors of joints, and none of an object.
StudySummary Summarise(const Study& study, const std::string& text, bool of_joints = false) {
  const TempFolder folder;
  StudyIdentity identity = MakeIdentity(study, text);
  identity[1].second = text;
  identity[3].second = MakeStudyInputs(study.text).scenario_text;
  StudyStore store = StudyStore::OpenOrCreate(folder.path() / "s.sqlite", identity, study);
  std::vector<TrialRow> rows;
  for (const Trial& trial : ListTrials(study)) {
    TrialRow row;
    row.trial = trial;
    row.result.outcome = trial.number % 2 == 0 ? Outcome::kTracked : Outcome::kDiverged;
    row.result.metrics[kPositionErrorRms] = 1.0 + static_cast<double>(trial.number);
    row.result.metrics[kEnergy] = 1.0 / row.result.metrics[kPositionErrorRms];
    row.result.metrics[kJointErrorRms] = std::numeric_limits<double>::quiet_NaN();
    if (of_joints) std::swap(row.result.metrics[kPositionErrorRms], row.result.metrics[kJointErrorRms]);
    if (trial.number % 2 == 1) row.result.failure = text;
    rows.push_back(row);
  }
  store.Add(rows);
  return SummariseStudy(store);
}

TEST(StudySummary, HasOutcomesAndTheBest) {
  const nlohmann::ordered_json json = Summarise(Parse(kGrid), "why at t = 1 s").json;
  EXPECT_EQ(json["done"], 4);
  EXPECT_EQ(json["total"], 4);
  EXPECT_EQ(json["outcomes"][0]["name"], "tracked");
  EXPECT_EQ(json["outcomes"][0]["count"], 2);
  EXPECT_EQ(json["best"]["order"], "By rms position error, of the trials that tracked.");
  EXPECT_EQ(json["best"]["rows"][0]["trial"], 0);
  EXPECT_EQ(json["failures"]["3"], "why at t = 1 s");
  EXPECT_EQ(json["versions"]["git_revision"], "why at t = 1 s");
}

TEST(StudySummary, NoTextBecomesMarkup) {
  const Study study = Parse("description = '" + kMarkup + "'\n" + kGrid);
  const std::string page = MakeStudyPage(Summarise(study, kMarkup));
  EXPECT_THAT(page, Not(HasSubstr("<img")));
  EXPECT_THAT(page, Not(HasSubstr(kMarkup)));
}

TEST(StudySummary, OfJointsHasTheirError) {
  const nlohmann::ordered_json json = Summarise(Parse(kGrid), "why", /*of_joints=*/true).json;
  EXPECT_EQ(json["error"], "joint_error_rms");
  EXPECT_EQ(json["best"]["order"], "By rms joint error, of the trials that tracked.");
}

/// The numbers of the trials that a page has, row by row.
std::vector<std::vector<double>> ReadValues(const StudySummary& summary) {
  const size_t width = summary.json["columns"].size();
  std::vector<std::vector<double>> rows(summary.values.size() / sizeof(double) / width,
                                        std::vector<double>(width));
  for (size_t i = 0; i < rows.size(); ++i)
    std::memcpy(rows[i].data(), summary.values.data() + i * width * sizeof(double), width * sizeof(double));
  return rows;
}

// All trials of seed 2 diverge, and the last key has ten values: a step through the rows would show one seed,
// or two of the ten.
TEST(StudySummary, OfManyTrialsItHasWholePointsAndTheBest) {
  const StudySummary summary = Summarise(
      Parse(
          "seeds = [1, 2]\n[[vary]]\nkey = 'control.K_p'\n"
          "from = 1\nto = 100\ncount = 1250\n[[vary]]\nkey = 'control.K_v'\nfrom = 1\nto = 10\ncount = 10\n"),
      "why");
  EXPECT_EQ(summary.json["done"], 25000);
  const std::vector<std::vector<double>> rows = ReadValues(summary);
  const std::vector<long> added = summary.json["added"];
  ASSERT_GT(rows.size(), added.size());
  const size_t drawn = rows.size() - added.size();
  EXPECT_LE(drawn, kMostShown);
  EXPECT_GE(drawn, kMostShown - 1);
  std::map<double, std::array<int, 2>> seeds_of_value;
  for (const std::vector<double>& row : rows) {
    if (std::ranges::find(added, static_cast<long>(row[0])) == added.end())
      ++seeds_of_value[row[4]][row[1] == 1.0 ? 0 : 1];
  }
  ASSERT_EQ(seeds_of_value.size(), 10U);
  for (const auto& [value, counts] : seeds_of_value) {
    EXPECT_EQ(counts[0], counts[1]) << value << ": each point with both seeds";
    EXPECT_GT(counts[0], 850) << value;
  }
  // The best are on the page, and those that were not drawn are said to be additions.
  for (const auto& best : summary.json["best"]["rows"]) {
    const auto is_it = [&](const std::vector<double>& row) { return row[0] == best["trial"].get<double>(); };
    EXPECT_EQ(std::ranges::count_if(rows, is_it), 1) << best;
  }
  EXPECT_FALSE(added.empty());
}

TEST(StudySummary, ATrialHasTheCommandThatRepeatsIt) {
  const Study study = Parse("set = [\"duration=1\"]\n" + kGrid);
  TrialRow row;
  row.trial = {3, 7, {2.0, 200.0}};
  row.result.metrics[kEnergy] = 0.1;
  const nlohmann::ordered_json json = ToJson(study, row);
  EXPECT_EQ(json["command"],
            "dexcheck run offset --set duration=1 --set control.K_p=2 --set control.K_v=200 --seed 7 "
            "--no-check --video --out trial-3");
  EXPECT_EQ(json["keys"]["control.K_v"], 200.0);
  EXPECT_EQ(json["metrics"]["energy"], 0.1);
}

TEST(StudyFindings, ReportsTheSpreadOfWhatHasNoOrder) {
  const Study study = Parse(
      "seeds = [1, 2, 3, 4]\nmetrics = ['position_error_rms']\n"
      "[[vary]]\nkey = 'control.law'\nvalues = ['computed_torque', 'pd_gravity']\n");
  std::vector<TrialRow> rows;
  for (const Trial& trial : ListTrials(study)) {
    TrialRow row;
    row.trial = trial;
    // 1, 4, 9, 16; the other law loses the grasp in all trials but the third.
    row.result.metrics[kPositionErrorRms] = static_cast<double>(trial.seed * trial.seed);
    if (trial.parameters.front() == 1.0 && trial.seed != 3) row.result.outcome = Outcome::kLostContact;
    rows.push_back(row);
  }
  ASSERT_EQ(rows.size(), 8U);
  EXPECT_THAT(ListFindings(study, rows),
              ElementsAre("control.law = computed_torque: held in 4 of 4 trials; position_error_rms 6.5 (1 "
                          "to 16) m, medians and ranges.",
                          "control.law = pd_gravity: held in 1 of 4 trials; position_error_rms 9 (9 to 9) m, "
                          "medians and ranges."));
}

// The best of a search that presses against its range, in the quantity's unit.
TEST(StudyFindings, ReportsWhatIsWantedWithItsUnitAndItsEdge) {
  const Study study = Parse(
      "[[objective]]\nminimize = 'settling_time'\n[search]\nmethod = 'cma_es'\ncount = 24\npopulation = "
      "8\nseed = 1\n[[vary]]\nkey = 'control.K_p'\nfrom = 1\nto = 100\n[[vary]]\nkey = 'control.K_v'\nfrom = "
      "1\nto = 100\n");
  std::vector<TrialRow> rows;
  const std::vector<std::vector<double>> points = {{50, 50}, {100, 30}, {20, 30}};
  for (size_t i = 0; i < points.size(); ++i) {
    TrialRow row;
    row.trial = {static_cast<long>(i), 0, points[i]};
    row.result.metrics[kSettlingTime] = i == 0 ? std::nan("") : 0.01 * static_cast<double>(i);
    rows.push_back(row);
  }
  EXPECT_THAT(ListFindings(study, rows),
              ElementsAre("The least settling_time of 3 points is 0.01 s, at control.K_p = 100, control.K_v "
                          "= 30 (trial 1). The search began where it has no value. At an end of its range is "
                          "control.K_p: a wider range may give a better one."));
}

}  // namespace
}  // namespace dexcheck::testing::study_summary_test
