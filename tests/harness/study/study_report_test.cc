// A study's page from a database that somebody else may have written.

#include "harness/study/study_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "controller/common/toml_reader.h"
#include "tests/common/files.h"
#include "tests/common/paths.h"

namespace dexcheck {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

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
  std::string Report(const std::string& text) {
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

TEST_F(StudyReportTest, TextsMayHaveAnyLength) {
  constexpr size_t kLength = 1000000;
  const std::string page = Report(std::string(kLength, 'x') + " at t = 1 s");
  EXPECT_THAT(page, HasSubstr(std::string(kLength, 'x')));
}

// Of many trials the page has pictures of the maps and an even part of the trials.
TEST_F(StudyReportTest, ManyTrialsMakeASmallPage) {
  study_ = ParseStudy(
      "name = \"many\"\nscenario = \"offset\"\n[[vary]]\nkey = 'control.K_p'\nfrom = 1\nto = 100\ncount = "
      "150\n[[vary]]\nkey = 'control.K_v'\nfrom = 1\nto = 100\ncount = 150\n",
      "study.toml");
  const std::string page = Report("why");
  constexpr size_t kMost = 10U << 20U;
  EXPECT_LT(page.size(), kMost);
  EXPECT_THAT(page, HasSubstr("<image "));
  EXPECT_THAT(page, HasSubstr("data:image/png;base64,iVBORw0KGgo"));
  EXPECT_THAT(page, Not(HasSubstr("<rect x=\"70.00\" y=\"30.00\" width=\"2.90\"")));
  EXPECT_THAT(page, HasSubstr("of 22500 trials; <code>dexcheck study show DB NUMBER</code>"));
  EXPECT_THAT(page, HasSubstr("id=\"trial-0\""));
}

}  // namespace
}  // namespace dexcheck
