// A study's page in a browser.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "controller/common/toml_reader.h"
#include "harness/study/study_report.h"
#include "harness/study/study_theory.h"
#include "tests/common/browser.h"
#include "tests/common/files.h"
#include "tests/common/matchers.h"
#include "tests/common/paths.h"

namespace dexcheck::testing::study_page_test {
namespace {

const std::string kSource = testing::SourcePath();
constexpr double kLimit = 2000.0;  // 1/s: of K_v at steps of 1 ms
constexpr double kLastLaw = 4.0;   // the fifth

StudyInputs MakeInputs(const std::string& study) {
  StudyInputs inputs;
  inputs.study = ParseStudy(study, "study.toml");
  inputs.scenario_text = ReadTextFile(kSource + "/harness/shipped/scenarios/offset.toml");
  inputs.scenario_source = "offset";
  inputs.robot = kSource + "/controller/parameters/assistant_robot.toml";
  inputs.mjcf = kSource + "/mjcf/scene.xml";
  return inputs;
}

class StudyPageBrowserTest : public ::testing::Test {
 protected:
  void SetUp() override {
    WritePage(
        "name = \"page\"\ndescription = \"a <small> study\"\nscenario = \"offset\"\nmetrics = "
        "[\"overshoot\", "
        "\"energy\"]\n[[vary]]\nkey = \"control.K_p\"\nvalues = [100, 1e3, 1e4]\n[[vary]]\nkey = "
        "\"control.K_v\"\nvalues = [20, 200, 2100, 3000]\n",
        "page");
  }

  /// NAME.html of a study's trials.
  void WritePage(const std::string& study, const std::string& name) const {
    const StudyInputs inputs = MakeInputs(study);
    StudyStore store =
        StudyStore::OpenOrCreate(folder_.path() / (name + ".sqlite"), IdentifyStudy(inputs), inputs.study);
    for (const Trial& trial : ListTrials(inputs.study)) store.Add(MakeRow(trial));
    testing::WriteText(folder_.path() / (name + ".html"), MakeStudyReport(store));
  }

  static TrialRow MakeRow(const Trial& trial) {
    TrialRow row;
    row.trial = trial;
    row.result.metrics.fill(1.0 / static_cast<double>(trial.number + 1));
    // The last number, of K_v or of a law.
    if (trial.parameters.back() > kLimit || trial.parameters.back() == kLastLaw) {
      row.result.outcome = Outcome::kDiverged;
      row.result.failure = "motor \"wheel_left\" is at its limit, 30 N m at t = 0.01 s";
    }
    return row;
  }

  void Open(int width, int height, bool mobile) {
    browser_.SetViewport(width, height, mobile);
    browser_.Open(folder_.path() / "page.html");
  }

  testing::TempFolder folder_;
  Browser& browser_ = Browser::Fraction();
};

TEST_F(StudyPageBrowserTest, ACellShowsTheCommandThatRepeatsItsTrial) {
  Open(1280, 900, false);
  // A cell for each trial in each of the maps: the outcome and two metrics.
  EXPECT_EQ(browser_.Run("return document.querySelectorAll('svg a rect').length;"), 3 * 12);
  const nlohmann::json place = browser_.Run(
      "document.getElementById('maps').scrollIntoView({behavior: 'instant'});"
      "const r = document.querySelector('svg a[href=\"#trial-5\"] rect').getBoundingClientRect();"
      "return {x: Math.round(r.x + r.width / 2), y: Math.round(r.y + r.height / 2), scroll: scrollY};");
  ASSERT_GT(place["scroll"], 0);
  const int x = place["x"];
  const int y = place["y"];
  browser_.Drag(x, y, x, y);
  ASSERT_TRUE(browser_.WaitFor("return document.querySelector(':target') !== null;"));
  const nlohmann::json shown = browser_.Run(
      "const r = document.querySelector(':target').getBoundingClientRect();"
      "return {id: document.querySelector(':target').id, text: document.querySelector(':target').innerText,"
      "  inside: r.top >= 0 && r.bottom <= innerHeight, scroll: scrollY};");
  EXPECT_EQ(shown["id"], "trial-5");
  EXPECT_THAT(shown["text"].get<std::string>(),
              HasSubstr("dexcheck run offset --set control.K_p=1000 --set control.K_v=200"));
  EXPECT_EQ(shown["inside"], true);
  EXPECT_EQ(shown["scroll"], place["scroll"]) << "the map stays in view";
  EXPECT_TRUE(browser_.Run("document.querySelector(':target .close').click();").is_null());
  EXPECT_TRUE(browser_.WaitFor("return document.querySelector(':target') === null;"));
  EXPECT_THAT(browser_.TakeConsole(), ::testing::IsEmpty());
}

// All that a page has works for a study of one key too, and nothing sticks out at any width.
TEST_F(StudyPageBrowserTest, FitsEveryWidthWithoutAnError) {
  const std::string head = "name = 'page'\nscenario = 'offset'\n[[vary]]\nkey = 'control.K_p'\n";
  const std::string nested =
      "[nested]\nmethod = 'random'\ncount = 3\nseed = 1\n[[nested.vary]]\nkey = "
      "'plant.finger_friction'\nfrom = 0.5\nto = 1\n";
  const std::vector<std::string> studies = {
      head + "values = [100, 1000]\n", head + "values = [100, 1000]\n" + nested,
      head +
          "values = [100, 1000]\n[[vary]]\nkey = 'control.K_v'\nvalues = [20, 3000]\n[[vary]]\nkey = "
          "'control.law'\nvalues = ['computed_torque', 'pd_gravity']\n[[objective]]\nminimize = 'energy'\n"};
  for (const std::string& study : studies) {
    std::filesystem::remove(folder_.path() / "page.sqlite");
    WritePage(study, "page");
    for (const int width : {360, 768, 1280}) {
      Open(width, 900, width == 360);
      EXPECT_TRUE(browser_.WaitFor("return document.getElementById('explore').dataset.ready === 'yes';"))
          << study;
      EXPECT_TRUE(browser_.Run("return document.documentElement.scrollWidth <= innerWidth;"))
          << width << study;
      EXPECT_THAT(browser_.TakeConsole(), ::testing::IsEmpty()) << study;
    }
  }
}

TEST_F(StudyPageBrowserTest, DrawsMeasuredAndTheoreticalBoundaries) {
  Open(1280, 900, false);
  const std::string map = "const map = document.querySelector('main figure');";
  // Three columns, in each the measured boundary runs between 200 and 2100.
  const nlohmann::json edges =
      browser_.Run(map + "return [...map.querySelectorAll('.edge')].map(e => Number(e.getAttribute('y1')));");
  ASSERT_EQ(edges.size(), 3U);
  // In theory K_v < 2 / h - h K_p / 2: where the dots of stability lie, between the middles of these rows.
  const nlohmann::json dots = browser_.Run(
      map +
      "return [...map.querySelectorAll('.dot[fill=\"#0b3c8c\"]')].map(e => Number(e.getAttribute('cy')));");
  ASSERT_GT(dots.size(), 10U);
  const double row = browser_.Run(map + "return map.querySelector('a rect').height.baseVal.value;");
  for (const nlohmann::json& y : dots) EXPECT_NEAR(y.get<double>(), edges[0].get<double>(), 0.5 * row);
  EXPECT_THAT(browser_.Run("return document.body.innerText;").get<std::string>(),
              HasSubstr("tell 12 of 12 trials rightly"));
}

// The part with a script: what it draws, how it filters, sorts and leads to a trial.
TEST_F(StudyPageBrowserTest, LooksCloserAtItsTrials) {
  Open(1300, 900, false);
  ASSERT_TRUE(browser_.WaitFor("return document.getElementById('explore').dataset.ready === 'yes';"));
  const auto ask = [&](const std::string& body) { return browser_.Run(body); };
  EXPECT_EQ(ask("return document.getElementById('explore-count').textContent;"), "12 of 12 trials");
  // Something is painted on each canvas.
  EXPECT_EQ(ask("return [...document.querySelectorAll('#explore canvas')].filter(c => "
                "c.getContext('2d').getImageData(0, 0, "
                "c.width, c.height).data.some(v => v !== 0)).length;"),
            3);
  // A filter leaves what it says.
  const std::string type = "const f = document.getElementById('explore-filter'); f.value = '";
  ask(type + "control.K_v < 1000, control.K_p >= 1e3'; f.dispatchEvent(new Event('input'));");
  EXPECT_EQ(ask("return document.getElementById('explore-count').textContent;"), "4 of 12 trials");
  ask(type + "'; f.dispatchEvent(new Event('input'));");
  ask("const o = document.getElementById('explore-outcome'); o.value = '4'; o.dispatchEvent(new "
      "Event('change'));");
  EXPECT_EQ(ask("return document.getElementById('explore-count').textContent;"), "6 of 12 trials")
      << "that diverged";
  ask("const o = document.getElementById('explore-outcome'); o.value = ''; o.dispatchEvent(new "
      "Event('change'));");
  // Sorted by energy, the largest first: trial 0 has 1, trial 11 a twelfth.
  const std::string energy =
      "[...document.querySelectorAll('#explore-head th')].find(t => t.textContent === 'energy')";
  ask(energy + ".click();");
  EXPECT_EQ(ask("return document.querySelector('#explore-body td').textContent;"), "11");
  ask(energy + ".click();");
  EXPECT_EQ(ask("return document.querySelector('#explore-body td').textContent;"), "0");
  EXPECT_EQ(ask("return " + energy + ".getAttribute('aria-sort');"), "descending");
  // A trial that is chosen shows its command, with the numbers exactly.
  ask("document.querySelectorAll('#explore-body tr')[5].click();");
  EXPECT_EQ(
      ask("return document.getElementById('explore-command').textContent;"),
      "dexcheck run offset --set control.K_p=1000 --set control.K_v=200 --no-check --video --out trial-5");
  EXPECT_THAT(ask("return document.getElementById('explore-budget').textContent;").get<std::string>(),
              HasSubstr("dexcheck budget offset --set control.K_p=1000"));
  EXPECT_EQ(ask("return document.querySelectorAll('#explore-importance tr').length;"), 2);
  EXPECT_THAT(browser_.TakeConsole(), ::testing::IsEmpty());
}

// Where (57) turns stands in the charts: a line across the axis of a key, a curve over two keys.
TEST_F(StudyPageBrowserTest, DrawsTheoryIntoTheChartsThatAreChosen) {
  Open(1300, 900, false);
  ASSERT_TRUE(browser_.WaitFor("return document.getElementById('explore').dataset.ready === 'yes';"));
  const nlohmann::json theory =
      browser_.Run("return JSON.parse(document.getElementById('study-data').textContent).theory;");
  EXPECT_EQ(theory["knows"], (std::vector<bool>{true, true}));
  double limit = 0.0;
  for (const nlohmann::json& turn : theory["turns"]) {
    if (turn["key"] == 1 && turn["stability"] == true) limit = turn["value"];
  }
  constexpr double kBisected = 2.0;  // of 2980 in 32 parts, halved ten times
  EXPECT_NEAR(limit, kLimit - 0.5e-3 * 100.0, kBisected)
      << "K_v < 2 / h - h K_p / 2 at the first trial's K_p";
  EXPECT_THAT(browser_.TakeConsole(), ::testing::IsEmpty());
  // Dark pixels of a chart along K_v (the browser warns of reading them, which no page does), in a column at
  // the limit and in one beside it.
  const std::string count =
      "const s = document.getElementById('explore-x'); s.value = '4'; s.dispatchEvent(new Event('change'));"
      "const c = document.getElementById('explore-scatter'), g = c.getContext('2d');"
      "const w = c.getBoundingClientRect().width, low = Math.log10(20), high = Math.log10(3000);"
      "const room = 0.04 * (high - low);"
      "const place = v => (60 + (Math.log10(v) - low + room) / (high - low + 2 * room) * (w - 70)) * "
      "devicePixelRatio;"
      "const dark = x => { const d = g.getImageData(Math.round(x) - 2, 20, 5, 200).data; let n = 0;"
      "  for (let i = 0; i < d.length; i += 4) if (d[i + 3] > 100) ++n; return n; };";
  const nlohmann::json pixels = browser_.Run(count + "return [dark(place(2000)), dark(place(1200))];");
  EXPECT_GT(pixels[0].get<int>(), 150);
  EXPECT_LT(pixels[1].get<int>(), 50);
  EXPECT_THAT(
      browser_.Run("return document.getElementById('explore-theory').textContent;").get<std::string>(),
      HasSubstr("turn unstable"));
  EXPECT_THAT(
      browser_.Run("return document.getElementById('explore-theory-over').textContent;").get<std::string>(),
      HasSubstr("other keys as in the first trial"));
}

// Of a search whose objective (57) knows: the least that it has, what it makes of each point, its Pareto
// front and its curve along a key.
TEST_F(StudyPageBrowserTest, DrawsTheoryOfWhatIsSearched) {
  StudyInputs inputs = MakeInputs(
      "name = \"search\"\nscenario = \"offset\"\nset = [\"duration=0.4\"]\nmetrics = "
      "[\"position_error_rms\"]\n[[objective]]\nminimize = \"position_error_rms\"\n[search]\nmethod = "
      "\"nelder_mead\"\ncount = 8\n[[vary]]\nkey = \"control.K_p\"\nfrom = 100\nto = 1000\n[[vary]]\nkey = "
      "\"control.K_v\"\nfrom = 10\nto = 100\n");
  StudyStore store =
      StudyStore::OpenOrCreate(folder_.path() / "search.sqlite", IdentifyStudy(inputs), inputs.study);
  constexpr double kPlant = 1.1;  // what the rows have of theory's values
  for (long i = 0; i < 8; ++i) {
    const auto at = static_cast<double>(i);
    TrialRow row;
    row.trial = {i, 0, {200.0 + 100.0 * at, 20.0 + 10.0 * at}};
    row.result = PredictInTheory(inputs, row.trial.parameters);
    for (double& metric : row.result.metrics) metric = std::isfinite(metric) ? kPlant * metric : 1.0;
    store.Add(row);
  }
  testing::WriteText(folder_.path() / "search.html", MakeStudyReport(store));
  browser_.SetViewport(1300, 900, false);
  browser_.Open(folder_.path() / "search.html");
  ASSERT_TRUE(browser_.WaitFor("return document.getElementById('explore').dataset.ready === 'yes';"));
  const nlohmann::json data =
      browser_.Run("return JSON.parse(document.getElementById('study-data').textContent);");
  ASSERT_EQ(data["history"].size(), 8U);
  constexpr double kRounding = 1e-12;
  for (const nlohmann::json& point : data["history"]) {
    EXPECT_NEAR(point["value"].get<double>() / point["theory"].get<double>(), kPlant, kRounding);
    EXPECT_LT(data["theory"]["least"].get<double>(), point["theory"].get<double>());
  }
  EXPECT_THAT(
      browser_.Run("return document.getElementById('explore-theory-best').textContent;").get<std::string>(),
      HasSubstr("the best that they have within the ranges"));
  // Pixels of the colour of theory.
  const std::string count =
      "const count = id => { const c = document.getElementById('explore-' + id);"
      "  const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; let n = 0;"
      "  for (let i = 0; i < d.length; i += 4) if (d[i] < 40 && Math.abs(d[i + 1] - 95) < 25 &&"
      "    Math.abs(d[i + 2] - 115) < 25 && d[i + 3] > 100) ++n; return n; };"
      "const select = (id, name) => { const s = document.getElementById('explore-' + id);"
      "  s.value = [...s.options].find(o => o.text.startsWith(name)).value; s.dispatchEvent(new "
      "Event('change')); };";
  EXPECT_GT(browser_.Run(count + "return count('history');").get<int>(), 200);
  const auto draw = [&](const std::string& x, const std::string& y) {
    return browser_.Run(count + "select('x', '" + x + "'); select('y', '" + y +
                        "'); return {pixels: count('scatter'), "
                        "text: document.getElementById('explore-theory').textContent};");
  };
  const nlohmann::json along = draw("control.K_v", "position_error_rms");
  EXPECT_GT(along["pixels"].get<int>(), 100);
  EXPECT_THAT(along["text"].get<std::string>(), HasSubstr("what the error dynamics (57) make of it"));
  const nlohmann::json front = draw("settling_time", "position_error_rms");
  EXPECT_GT(front["pixels"].get<int>(), 20);
  EXPECT_THAT(front["text"].get<std::string>(), HasSubstr("the Pareto front of the error dynamics (57)"));
  const nlohmann::json unknown = draw("energy", "position_error_rms");
  EXPECT_EQ(unknown["pixels"].get<int>(), 0) << "which (57) does not know";
  EXPECT_EQ(unknown["text"], "");
}

// Long texts below a chart, the last of which has no trial that held above it.
TEST_F(StudyPageBrowserTest, TextsBelowAChartDoNotTouch) {
  WritePage(
      "name = \"laws\"\ndescription = \"laws\"\nscenario = \"offset\"\nmetrics = [\"energy\"]\nseeds = [1, "
      "2]\n"
      "[[vary]]\nkey = \"control.law\"\nvalues = [\"computed_torque\", \"operational_space\", "
      "\"feedforward_pd\", \"impedance\", \"pd_gravity\"]\n",
      "laws");
  browser_.SetViewport(1280, 900, false);
  browser_.Open(folder_.path() / "laws.html");
  const nlohmann::json found = browser_.Run(
      "const svg = document.querySelector('figure svg'), all = svg.getBoundingClientRect();"
      "const texts = [...svg.querySelectorAll('.tick[text-anchor=\"middle\"]')].map(t => [t.textContent, "
      "  t.getBoundingClientRect()]);"
      "const touching = [];"
      "for (const [a, r] of texts) for (const [b, s] of texts)"
      "  if (a !== b && Math.abs(r.top - s.top) < 2 && r.left <= s.left && s.left < r.right + 3)"
      "    touching.push(a + ' ' + b);"
      "return {count: texts.length, touching: touching, outside: texts.filter(([, r]) =>"
      "  r.left < all.left || r.right > all.right || r.bottom > all.bottom).map(([t]) => t)};");
  EXPECT_GE(found["count"], 7) << "five texts, two of them in two lines";
  EXPECT_EQ(found["touching"], nlohmann::json::array());
  EXPECT_EQ(found["outside"], nlohmann::json::array());
}

TEST_F(StudyPageBrowserTest, FitsAPhone) {
  Open(390, 844, true);
  ASSERT_TRUE(browser_.WaitFor("return document.getElementById('explore').dataset.ready === 'yes';"));
  EXPECT_LE(browser_.Run("return document.documentElement.scrollWidth - innerWidth;"), 0);
  EXPECT_THAT(browser_.TakeConsole(), ::testing::IsEmpty());
}

}  // namespace
}  // namespace dexcheck::testing::study_page_test
