// A study's page from a database that somebody else may have written.

#include "harness/study/study_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "controller/common/toml_reader.h"
#include "harness/study/study_answer.h"
#include "tests/common/files.h"
#include "tests/common/matchers.h"
#include "tests/common/paths.h"

namespace dexcheck::testing::study_report_test {
namespace {

const std::string kTheory = "The sampled error dynamics";
const std::string kMarkup = "<img src=x onerror=\"alert(1)\">";

class StudyReportTest : public ::testing::Test {
 protected:
  StudyReportTest() {
    study_ = ParseStudy("name = \"" + kName + "\"\ndescription = '" + kMarkup + "'\nscenario = '" + kMarkup +
                            "'\n[[vary]]\nkey = 'control.K_p'\nvalues = [1, 2]\n[[vary]]\nkey = "
                            "'control.K_v'\nvalues = [20, 200]\n",
                        "study.toml");
  }

  /// The page of a database with one text in all columns, the study itself and its scenario excepted.
  /// @param of_joints its trials have errors of joints, and none of an object.
  std::string Report(const std::string& text, bool of_joints = false) {
    StudyIdentity identity;
    for (const char* column : {"layout", "name", "study", "scenario", "robot", "mjcf_hash",
                               "dexcheck_version", "git_revision", "mujoco_version"}) {
      identity.emplace_back(column, text);
    }
    identity[0].second = "2";
    identity[2].second = study_.text;
    identity[3].second = ReadTextFile(testing::SourcePath("/harness/shipped/scenarios/offset.toml"));
    StudyStore store = StudyStore::OpenOrCreate(folder_.path() / "s.sqlite", identity, study_);
    std::vector<TrialRow> rows;
    for (const Trial& trial : ListTrials(study_)) {
      TrialRow row;
      row.trial = trial;
      row.result.outcome = trial.number % 2 == 0 ? Outcome::kTracked : Outcome::kDiverged;
      // All that tracked are on the front: the less error, the more work.
      row.result.metrics[kPositionErrorRms] = 1.0 + static_cast<double>(trial.number);
      row.result.metrics[kEnergy] = 1.0 / row.result.metrics[kPositionErrorRms];
      row.result.metrics[kJointErrorRms] = std::numeric_limits<double>::quiet_NaN();
      if (of_joints) std::swap(row.result.metrics[kPositionErrorRms], row.result.metrics[kJointErrorRms]);
      if (trial.number % 2 == 1) row.result.failure = text;
      rows.push_back(row);
    }
    store.Add(rows);
    return MakeStudyReport(store);
  }

  static inline const std::string kName = "page";
  testing::TempFolder folder_;
  Study study_;
};

TEST_F(StudyReportTest, NoTextBecomesMarkup) {
  const std::string page = Report(kMarkup);
  EXPECT_THAT(page, Not(HasSubstr("<img")));
  size_t count = 0;
  for (size_t at = page.find("&lt;img src=x"); at != std::string::npos;
       at = page.find("&lt;img src=x", at + 1)) {
    ++count;
  }
  EXPECT_GE(count, 6U) << "description, scenario, two versions, revision, failures: all are shown";
}

TEST_F(StudyReportTest, LinksToThePartsThatItHas) {
  const std::string page = Report("why");
  EXPECT_THAT(page, HasSubstr(kTheory));
  EXPECT_THAT(page, HasSubstr("By rms position error"));
  const std::string links = page.substr(page.find("<nav>"), page.find("</nav>") - page.find("<nav>"));
  const std::string kLink = "href=\"#";
  int count = 0;
  for (size_t at = links.find(kLink); at != std::string::npos; at = links.find(kLink, at + 1), ++count) {
    const size_t begin = at + kLink.size();
    const std::string id = links.substr(begin, links.find('"', begin) - begin);
    EXPECT_THAT(page, HasSubstr("id=\"" + id + "\"")) << "a link that leads nowhere";
  }
  EXPECT_GE(count, 4);
  EXPECT_THAT(links, HasSubstr("#maps"));
  EXPECT_THAT(links, Not(HasSubstr("#margins"))) << "a study of a grid has none";
}

// Theory is that of an object, which an arm that holds nothing has not.
TEST_F(StudyReportTest, OfJointsHasTheirErrorAndNoTheoryOfAnObject) {
  const std::string page = Report("why", /*of_joints=*/true);
  EXPECT_THAT(page, Not(HasSubstr(kTheory)));
  EXPECT_THAT(page, HasSubstr("1 rad<"));
  EXPECT_THAT(page, HasSubstr("least rms joint error"));
  EXPECT_THAT(page, HasSubstr("By rms joint error"));
}

TEST(StudyAnswer, TellsTheSpreadOfWhatHasNoOrder) {
  const Study study = ParseStudy(
      "name = 'laws'\nscenario = 'curve'\nseeds = [1, 2, 3, 4]\nmetrics = ['position_error_rms']\n"
      "[[vary]]\nkey = 'control.law'\nvalues = ['computed_torque', 'pd_gravity']\n",
      "study.toml");
  std::vector<TrialRow> rows;
  for (const Trial& trial : ListTrials(study)) {
    TrialRow row;
    row.trial = trial;
    const bool second = trial.parameters.front() != ListTrials(study).front().parameters.front();
    // 1, 4, 9, 16; the other law loses the grasp in all trials but the third.
    row.result.metrics[kPositionErrorRms] = static_cast<double>(trial.seed * trial.seed);
    if (second && trial.seed != 3) row.result.outcome = Outcome::kLostContact;
    rows.push_back(row);
  }
  ASSERT_EQ(rows.size(), 8U);
  EXPECT_THAT(AnswerStudy(study, rows),
              ::testing::ElementsAre("control.law = computed_torque: held in 4 of 4 trials; "
                                     "position_error_rms 6.5 (1 to 16) m, medians and ranges.",
                                     "control.law = pd_gravity: held in 1 of 4 trials; "
                                     "position_error_rms 9 (9 to 9) m, medians and ranges."));
}

// The best of a search that presses against its range, in the quantity's unit; the page's first words are
// about it.
TEST_F(StudyReportTest, TellsWhatIsWantedWithItsUnitAndItsEdge) {
  study_ = ParseStudy(
      "name = 'wanted'\nscenario = 'offset'\n[[objective]]\nminimize = 'settling_time'\n[search]\nmethod = "
      "'cma_es'\ncount = 24\npopulation = 8\nseed = 1\n[[vary]]\nkey = 'control.K_p'\nfrom = 1\nto = 100\n"
      "[[vary]]\nkey = 'control.K_v'\nfrom = 1\nto = 100\n",
      "study.toml");
  std::vector<TrialRow> rows;
  const std::vector<std::vector<double>> points = {{50, 50}, {100, 30}, {20, 30}};
  for (size_t i = 0; i < points.size(); ++i) {
    TrialRow row;
    row.trial = {static_cast<long>(i), 0, points[i]};
    row.result.metrics[kSettlingTime] = i == 0 ? std::nan("") : 0.01 * static_cast<double>(i);
    rows.push_back(row);
  }
  const std::string kAnswer =
      "The least settling_time of 3 points is 0.01 s, at control.K_p = 100, control.K_v = 30 (trial 1). The "
      "search began where it has no value. At an end of its range is control.K_p: a wider range may give a "
      "better one.";
  EXPECT_THAT(AnswerStudy(study_, rows), ::testing::ElementsAre(kAnswer));
  study_ = ParseStudy(
      "name = 'wanted'\nscenario = 'offset'\n[[objective]]\nminimize = 'energy'\n[[vary]]\nkey = "
      "'control.K_p'\nvalues = [1, 2, 3]\n",
      "study.toml");
  const std::string page = Report("why");
  EXPECT_THAT(page, HasSubstr("<b>0.333 J</b><span>least energy</span>"));
  EXPECT_THAT(page, Not(HasSubstr("least rms position error")));
}

TEST_F(StudyReportTest, TextsMayHaveAnyLength) {
  constexpr size_t kLength = 1000000;
  const std::string page = Report(std::string(kLength, 'x') + " at t = 1 s");
  EXPECT_THAT(page, HasSubstr(std::string(kLength, 'x')));
}

// Of many trials the page has pictures of the maps and an even part of the trials.
TEST_F(StudyReportTest, ManyTrialsMakeASmallPage) {
  study_ = ParseStudy(
      "name = \"many\"\nscenario = \"offset\"\n[[objective]]\nmaximize = 'position_error_rms'\n[[vary]]\nkey "
      "= 'control.K_p'\nfrom = 1\nto = 100\ncount = "
      "150\n[[vary]]\nkey = 'control.K_v'\nfrom = 1\nto = 100\ncount = 150\n",
      "study.toml");
  const std::string page = Report("why");
  constexpr size_t kMost = 10U << 20U;
  EXPECT_LT(page.size(), kMost);
  EXPECT_THAT(page, HasSubstr("<image "));
  EXPECT_THAT(page, HasSubstr("data:image/png;base64,iVBORw0KGgo"));
  EXPECT_THAT(page, Not(HasSubstr("<rect x=\"86.00\" y=\"30.00\" width=\"2.90\"")));
  EXPECT_THAT(page, HasSubstr("of 22500 trials; <code>dexcheck study show DB NUMBER</code>"));
  EXPECT_THAT(page, HasSubstr("id=\"trial-0\""));
  // The last that tracked have the largest error, and are not among each so many.
  EXPECT_THAT(page, HasSubstr("<a href=\"#trial-22496\">22496</a>"));
  EXPECT_THAT(page, HasSubstr("id=\"trial-22496\""));
}

}  // namespace
}  // namespace dexcheck::testing::study_report_test
