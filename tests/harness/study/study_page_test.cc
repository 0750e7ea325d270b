// A study's page in a browser.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "harness/study/search.h"
#include "harness/study/study_findings.h"
#include "tests/common/browser.h"
#include "tests/common/files.h"
#include "tests/common/matchers.h"
#include "tests/harness/study/study_fixture.h"

namespace dexcheck::testing::study_page_test {
namespace {

constexpr double kLimit = 2000.0;  // 1/s: of K_v at steps of 1 ms
constexpr double kLastLaw = 4.0;   // the fifth

const std::string kGrid =
    "description = \"a <small> study\"\nmetrics = [\"overshoot\", \"energy\"]\n[[vary]]\nkey = "
    "\"control.K_p\"\nvalues = [100, 1e3, 1e4]\n[[vary]]\nkey = \"control.K_v\"\nvalues = [20, 200, 2100, "
    "3000]\n";

class StudyPageBrowserTest : public ::testing::Test {
 protected:
  /// Opens the page of a study whose trials are all there.
  void Open(const std::string& study, int width = 1280) {
    const StudyInputs inputs = MakeStudyInputs("name = \"page\"\nscenario = \"offset\"\n" + study);
    std::filesystem::remove(folder_.path() / "page.sqlite");
    StudyStore store =
        StudyStore::OpenOrCreate(folder_.path() / "page.sqlite", IdentifyStudy(inputs), inputs.study);
    const std::vector<Trial> trials =
        inputs.study.is_search() ? SearchHistory(inputs.study).ListMissing() : ListTrials(inputs.study);
    std::vector<TrialRow> rows;
    for (const Trial& trial : trials) rows.push_back(MakeRow(trial));
    store.Add(rows);
    WriteText(folder_.path() / "page.html", MakeStudyPage(SummariseStudy(store)));
    browser_.SetViewport(width, 900, width < 500);
    browser_.Open(folder_.path() / "page.html");
    EXPECT_TRUE(browser_.WaitFor("return document.getElementById('explore').dataset.ready === 'yes';"));
    EXPECT_THAT(browser_.TakeConsole(), IsEmpty()) << study;
  }

  static TrialRow MakeRow(const Trial& trial) {
    TrialRow row = MakeTrialRow(trial, 1.0 / static_cast<double>(trial.number + 1));
    if (trial.seed == 2 && trial.parameters.size() == 2) row.result.outcome = Outcome::kLostContact;
    // The last number, of K_v or of a law.
    if (trial.parameters.back() > kLimit || trial.parameters.back() == kLastLaw) {
      row.result.outcome = Outcome::kDiverged;
      row.result.failure = "motor \"wheel_left\" is at its limit, 30 N m at t = 0.01 s";
    }
    return row;
  }

  nlohmann::json Run(const std::string& body) const { return browser_.Run(body); }
  [[nodiscard]] std::string Text(const std::string& id) const {
    return Run("return document.getElementById('" + id + "').textContent;");
  }

  TempFolder folder_;
  Browser& browser_ = Browser::Shared();
};

TEST_F(StudyPageBrowserTest, ACellShowsTheCommandThatRepeatsItsTrial) {
  Open(kGrid);
  // A map for the outcome and for each of two metrics, with a cell for each trial.
  EXPECT_EQ(Run("return [...document.querySelectorAll('#maps canvas')].map(c => "
                "Chart.getChart(c).data.datasets[0].data.length);"),
            (std::vector<int>{12, 12, 12}));
  const nlohmann::json place = Run(
      "const canvas = document.querySelector('#maps canvas'); canvas.scrollIntoView({behavior: 'instant', "
      "block: 'center'});const chart = Chart.getChart(canvas), i = chart.data.datasets[0].data.findIndex(c "
      "=> c.row === 5);const p = chart.getDatasetMeta(0).data[i], r = canvas.getBoundingClientRect();return "
      "{x: Math.round(r.x + p.x), y: Math.round(r.y + p.y)};");
  browser_.Drag(place["x"], place["y"], place["x"], place["y"]);
  ASSERT_TRUE(browser_.WaitFor("return !document.getElementById('explore-chosen').hidden;"));
  EXPECT_EQ(
      Text("explore-command"),
      "dexcheck run offset --set control.K_p=1000 --set control.K_v=200 --no-check --video --out trial-5");
  EXPECT_EQ(Run("return location.hash;"), "#trial-5");
  EXPECT_THAT(browser_.TakeConsole(), IsEmpty());
}

// All that a page has works for studies of every kind, and nothing sticks out at any width.
TEST_F(StudyPageBrowserTest, FitsEveryWidthWithoutAnError) {
  const std::string one = "[[vary]]\nkey = 'control.K_p'\n";
  const std::string range = "from = 5\nto = 50\n", second = "[[vary]]\nkey = 'control.K_v'\n";
  const std::vector<std::string> studies = {
      one + "values = [100, 1000]\n",
      one + "values = [100, 1000]\n" + second +
          "values = [20, 3000]\n[[vary]]\nkey = 'control.law'\nvalues = ['computed_torque', "
          "'pd_gravity']\n[[objective]]\nminimize = 'energy'\n",
      "seeds = [1, 2]\n[[vary]]\nkey = \"control.law\"\nvalues = [\"computed_torque\", "
      "\"operational_space\", \"feedforward_pd\", \"impedance\", \"pd_gravity\"]\n",
      "[sample]\nmethod = 'morris'\ncount = 8\n" + one + range + second + range,
      "[[objective]]\nminimize = 'energy'\n[search]\nmethod = 'cma_es'\ncount = 40\n" + one + range + second +
          range};
  for (const std::string& study : studies) {
    for (const int width : {360, 768, 1280}) {
      Open(study, width);
      EXPECT_LE(Run("return document.documentElement.scrollWidth - innerWidth;"), 0) << width << study;
      EXPECT_EQ(
          Run("return [...document.querySelectorAll('canvas')].filter(c => !Chart.getChart(c)).length;"), 0)
          << "each chart is drawn";
      if (width == 1280) {
        // Maps and charts in every colour, sorted and filtered.
        EXPECT_GT(browser_.WorkControls(), 12) << study;
        EXPECT_EQ(
            Run("const x = document.getElementById('explore-color'); return [...x.options].length > 3;"),
            true);
      }
    }
  }
}

// Every trial of seed 2 was lost. A grid's rows alternate between the seeds: every other one would be all
// green.
TEST_F(StudyPageBrowserTest, APartOfManyTrialsHasEverySeed) {
  Open(
      "seeds = [1, 2]\nmetrics = ['energy']\n[[vary]]\nkey = 'control.K_p'\nfrom = 1\nto = 100\ncount = "
      "1250\n[[vary]]\n"
      "key = 'control.K_v'\nfrom = 11\nto = 20\ncount = 10\n");
  const std::string held = "Chart.getChart(document.querySelector('#maps canvas')).data.datasets[0].data";
  const std::string tracked = Run("return ReadJson('study-data').outcomes[0].color;");
  EXPECT_GT(Run("return " + held + ".length;"), 0);
  EXPECT_EQ(Run("return " + held + ".filter(c => c.color === '" + tracked + "').length;"), 0);
  // A chart's part of these has both seeds too.
  EXPECT_EQ(
      Run("const p = Chart.getChart(document.getElementById('explore-scatter')).data.datasets.at(-1).data; "
          "return new Set(p.map(q => q.color)).size;"),
      2);
  // The best are marks: the page has them, and counts them nowhere.
  const int added = Run("return ReadJson('study-data').added.length;");
  EXPECT_GT(added, 0);
  EXPECT_EQ(Text("explore-count"), "20000 of 20000 trials, a part of 25000");
  EXPECT_THAT(Text("trials-text"), HasSubstr("Here are 20000 of 25000 trials, those of points that a hash"));
  EXPECT_THAT(Text("trials-text"), HasSubstr(std::to_string(5000 - added) + " trials are left out"));
}

// The page draws, filters, sorts and leads to a trial; by the keyboard too.
TEST_F(StudyPageBrowserTest, LooksCloserAtItsTrials) {
  Open(kGrid);
  EXPECT_EQ(Text("explore-count"), "12 of 12 trials");
  const std::string type = "const f = document.getElementById('explore-filter'); f.value = '";
  Run(type + "control.K_v < 1000, control.K_p >= 1e3'; f.dispatchEvent(new Event('input'));");
  EXPECT_EQ(Text("explore-count"), "4 of 12 trials");
  Run(type + "'; f.dispatchEvent(new Event('input'));");
  const auto choose = [&](const std::string& id, const std::string& value) {
    Run("const o = document.getElementById('explore-" + id + "'); o.value = '" + value +
        "'; o.dispatchEvent(new Event('change'));");
  };
  choose("outcome", "4");
  EXPECT_EQ(Text("explore-count"), "6 of 12 trials") << "that diverged";
  choose("outcome", "");
  // Sorted by energy, the largest first: trial 0 has 1, trial 11 a twelfth.
  const std::string energy =
      "[...document.querySelectorAll('#explore-head th')].find(t => t.textContent === 'energy, J')";
  Run(energy + ".click();");
  EXPECT_EQ(Run("return document.querySelector('#explore-body td').textContent;"), "11");
  Run(energy + ".dispatchEvent(new KeyboardEvent('keydown', {key: 'Enter'}));");
  EXPECT_EQ(Run("return document.querySelector('#explore-body td').textContent;"), "0");
  EXPECT_EQ(Run("return " + energy + ".getAttribute('aria-sort');"), "descending");
  // A trial that is chosen shows its command, with the numbers exactly, and is marked in each chart.
  Run("document.querySelectorAll('#explore-body tr')[5].dispatchEvent(new KeyboardEvent('keydown', {key: ' "
      "'}));");
  EXPECT_THAT(Text("explore-command"), HasSubstr("--set control.K_p=1000 --set control.K_v=200"));
  EXPECT_THAT(Text("explore-budget"), HasSubstr("dexcheck budget offset --set control.K_p=1000"));
  const std::string scatter = "Chart.getChart(document.getElementById('explore-scatter'))";
  EXPECT_EQ(Run("return " + scatter + ".data.datasets[0].data.map(p => p.row);"), (std::vector<int>{5}));
  // Two metrics are drawn with their front; all are the same, so that one point beats all others.
  choose("x", Run("return String([...document.getElementById('explore-x').options].find(o => o.text === "
                  "'energy, J').value);"));
  EXPECT_EQ(Run("return " + scatter + ".data.datasets[1].label;"), "Pareto front, 1 trials");
  EXPECT_THAT(browser_.TakeConsole(), IsEmpty());
}

// The table of the best of a study that says what it wants leads to its trials.
TEST_F(StudyPageBrowserTest, LeadsFromTheBestToTheirTrials) {
  Open(kGrid + "[[objective]]\nminimize = 'overshoot'\n");
  EXPECT_EQ(Run("return document.querySelectorAll('#best a').length;"), 6);
  Run("document.querySelector('#best a').click();");
  EXPECT_TRUE(browser_.WaitFor("return !document.getElementById('explore-chosen').hidden;"));
  EXPECT_THAT(browser_.TakeConsole(), IsEmpty());
}

}  // namespace
}  // namespace dexcheck::testing::study_page_test
