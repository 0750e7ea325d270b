// The page of judged recordings in a browser.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>
#include <string>

#include "harness/descriptions/read_description.h"
#include "harness/report/page.h"
#include "tests/common/browser.h"
#include "tests/common/files.h"
#include "tests/common/paths.h"
#include "tests/common/run_program.h"
#include "tests/harness/recordings/recorded_robot.h"

namespace dexcheck::testing::judge_browser_test {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kJoints = 7;
constexpr double kFriction = 2.0;  // N m, of the fourth joint
constexpr double kFrom = 4.0, kTo = 5.5, kForce = 40.0;

std::string ModelPath() { return SourcePath("/controller/parameters/panda.toml"); }

class JudgeBrowserTest : public ::testing::Test {
 protected:
  void ExpectNothingIsCutOff() {
    for (const int width : {360, 768, 1280}) {
      browser_.SetViewport(width, 900, false);
      EXPECT_LE(browser_.Run("return document.documentElement.scrollWidth - innerWidth;"), 0) << width;
      // A table that is wider than its card can be scrolled.
      EXPECT_EQ(browser_.Run(
                    "return [...document.querySelectorAll('.card, .verdict, .tiles b, p, h1, h3')]  "
                    ".filter(c => c.scrollWidth > c.clientWidth && getComputedStyle(c).overflowX !== 'auto' "
                    "&&    getComputedStyle(c).display !== 'inline').map(c => c.innerText.slice(0, 40));"),
                nlohmann::json::array())
          << width;
    }
  }
  void ExpectSoundPage() {
    EXPECT_EQ(browser_.CountRepeatedIds(), 0);
    EXPECT_EQ(browser_.CountLoaded(), 0);
    EXPECT_THAT(browser_.TakeConsole(), ::testing::IsEmpty());
  }
  [[nodiscard]] std::string TextOf(const std::string& selector) const {
    return browser_.Run("return document.querySelector('" + selector + "').innerText;");
  }

  TempFolder folder_;
  Browser& browser_ = Browser::Shared();
};

TEST_F(JudgeBrowserTest, TwoRecordingsAreShownWithTheirCauses) {
  std::mt19937 random(5);
  const RecordedFault friction = {"dry friction", "joint panda_joint4", kFriction,
                                  [](mjModel* robot) { robot->dof_frictionloss[3] = kFriction; }};
  const RecordedFault push = {
      "force", "link panda_link5", kForce, {}, [](double t, const mjModel& model, mjData* data) {
        if (t >= kFrom && t <= kTo) data->xfrc_applied[6 * model.jnt_bodyid[4] + 1] = kForce;
      }};
  RecordingOptions options;
  options.duration = 10.0;
  const RecordedTable first = RecordRobot("mjcf/panda.xml", {friction}, options, &random);
  const RecordedTable second = RecordRobot("mjcf/panda.xml", {friction, push}, options, &random);
  WriteCsv(first, folder_.path() / "first.csv");
  WriteCsv(second, folder_.path() / "second.csv");
  const std::filesystem::path page = folder_.path() / "judged.html";
  const ProgramResult result =
      RunProgram({ProgramPath(), "judge", ModelPath(), (folder_.path() / "first.csv").string(), "--recording",
                  (folder_.path() / "second.csv").string(), "--page", page.string(), "--json", "-"});
  ASSERT_EQ(result.exit_code, 1) << result.err;
  const Json json = Json::parse(result.out);

  browser_.SetViewport(1280, 12000);
  browser_.Open(page);
  ASSERT_TRUE(browser_.WaitFor("return [...document.querySelectorAll('[data-plot]')].every(b => b.chart);"));
  EXPECT_EQ(browser_.Run("return document.querySelectorAll('[data-plot]').length;"), 2 * 2 * kJoints);
  EXPECT_THAT(TextOf("#verdict"), ::testing::HasSubstr("does not explain 2 recordings; "));
  const std::string causes = TextOf("#causes ~ .card");
  EXPECT_THAT(causes, ::testing::HasSubstr("joint panda_joint4: dry friction"));
  EXPECT_THAT(causes, ::testing::HasSubstr("in second.csv")) << "the push";
  EXPECT_THAT(causes, ::testing::ContainsRegex("[34]\\.[0-9]+ to 5\\.[0-9]+")) << "when it was";
  EXPECT_EQ(browser_.Run("return [...document.querySelectorAll('.joints')].map(card => "
                         "card.querySelectorAll('tr').length);"),
            nlohmann::json({kJoints + 1, kJoints + 1}));

  // The fourth joint: what was measured, and what is left beyond the causes with its noise.
  const nlohmann::json points = browser_.Run(
      "const boxes = document.querySelectorAll('[data-plot]'); return [6, 7].map(k => "
      "boxes[k].chart.data.datasets[0].data.find(point => point.x > 3 && point.y));");
  const auto row = static_cast<size_t>(points[0]["x"].get<double>() / options.step);
  RecordedTable table = first;
  EXPECT_NEAR(points[0]["y"].get<double>(), table.Get("tau.panda_joint4")[row], 1.5) << "a mean over a block";
  EXPECT_LT(std::abs(points[1]["y"].get<double>()), 0.5 * kFriction);
  EXPECT_NEAR(
      browser_.Run("return document.querySelectorAll('[data-plot]')[7].chart.options.band;").get<double>(),
      2.0 * json["joints"][3]["noise"].get<double>(), 1e-9);

  // A zoom in the first recording's first plot is one in all.
  const nlohmann::json area = browser_.Run(
      "const {canvas, chartArea: a} = document.querySelectorAll('[data-plot]')[0].chart,  r = "
      "canvas.getBoundingClientRect();return [r.x + a.left, r.y + a.top + a.height / 2, "
      "a.width].map(Math.round);");
  const int x = area[0], y = area[1], width = area[2];
  browser_.Drag(x + width / 4, y, x + width / 2, y);
  ASSERT_TRUE(browser_.WaitFor(
      "const x = document.querySelectorAll('[data-plot]')[0].chart.scales.x;return x.max - x.min < 5;"));
  EXPECT_EQ(browser_.Run("const all = [...document.querySelectorAll('[data-plot]')].map(b => "
                         "[b.chart.scales.x.min, b.chart.scales.x.max].join());return new Set(all).size;"),
            1);
  EXPECT_EQ(browser_.Run("return ReadJson('replay-scene').parts;"), kJoints + 1)
      << "the joints' links and the world";
  EXPECT_THAT(TextOf("#replay"), ::testing::HasSubstr("The motion of first.csv."));
  EXPECT_GT(browser_.WorkControls(), 10);
  ExpectNothingIsCutOff();
  ExpectSoundPage();
}

/// Two causes, of which the motion tells neither from one more; times of a clock; a gap.
TEST_F(JudgeBrowserTest, ClassesAndClocksAreTold) {
  const RobotModel model(ReadDescription(ModelPath()).spec);
  constexpr double kClock = 1.7e9, kNaN = std::numeric_limits<double>::quiet_NaN();
  RecordingJudgement judgement;
  judgement.joints = {0};
  judgement.balances = {{.joint = 0, .torque = 5.0, .residual = 1.0, .left = 0.2, .noise = 0.1}};
  const auto add_cause = [&](const std::vector<Fault>& faults, const std::string& rival, double from) {
    Explanation one;
    one.outcome = faults.size() > 1 ? CauseOutcome::kNamedClass : CauseOutcome::kNamed;
    one.faults = faults;
    one.rival = rival;
    one.log_odds = 3.0 * std::log(10.0);
    one.from = from;
    one.to = from + 2.0;
    judgement.causes.push_back(one);
    judgement.found.emplace_back().fault.kind = TorqueFault::kCentre;
  };
  add_cause({{"mass", "link a", 1.0, 0.1, "kg", ""}, {"</script>", "link b", 2.0, 0.0, "kg", ""}},
            "link c: mass", kNaN);
  add_cause({{"mass", "link b", 1.0, std::numeric_limits<double>::infinity(), "kg", ""}}, "link a: mass",
            kClock + 1.0);
  for (const double t : {0.0, 0.1, 0.2, 0.3, 5.0, 5.1})
    judgement.traces.push_back({0, kClock + t, VectorXd::Zero(kJoints), VectorXd::Ones(1), VectorXd::Ones(1),
                                VectorXd::Ones(1), VectorXd::Zero(1)});
  Json json = {{"model", "panda.toml"},   {"verdict", "differs"},        {"rows", 6},
               {"explained", 0.9},        {"recordings", {"clock.csv"}}, {"notes", {"a note"}},
               {"joints", Json::array()}, {"causes", Json::array()}};
  json["joints"].push_back({{"joint", "panda_joint1"},
                            {"recording", 0},
                            {"torque", 5.0},
                            {"residual", 1.0},
                            {"left", 0.2},
                            {"noise", 0.1},
                            {"held_left", 0.3}});
  for (const Explanation& one : judgement.causes) json["causes"].push_back(ToJson(one));
  const std::filesystem::path page = folder_.path() / "judged.html";
  std::ofstream(page) << MakeJudgePage(model, judgement, json);
  browser_.SetViewport(1280, 4000);
  browser_.Open(page);
  ASSERT_TRUE(browser_.WaitFor("return [...document.querySelectorAll('[data-plot]')].every(b => b.chart);"));
  EXPECT_EQ(browser_.Run("return [...document.querySelectorAll('.matrix tr')].map(row => "
                         "[...row.children].map(cell => cell.textContent).join('|'));"),
            nlohmann::json({"explanation|1|2", "link a: mass|◆|1e3", "link b: </script>|◇|",
                            "link c: mass|1e3|", "link b: mass||●"}));
  const std::string causes = TextOf("#causes ~ .card");
  EXPECT_THAT(causes, ::testing::HasSubstr("one of these, which this motion does not separate:"));
  EXPECT_THAT(causes, ::testing::HasSubstr("1 ± 0.1 kg"));
  EXPECT_THAT(causes, ::testing::HasSubstr("of any size"));
  EXPECT_THAT(causes, ::testing::HasSubstr("1.000 to 3.000")) << "from the recording's begin";
  // Nothing is drawn across the gap.
  EXPECT_EQ(
      browser_.Run("return document.querySelector('[data-plot]').chart.data.datasets[0].data.map(p => "
                   "[Math.round(10 * p.x) / 10, Number.isFinite(p.y)]);"),
      nlohmann::json::parse("[[0,true],[0.1,true],[0.2,true],[0.3,true],[2.7,false],[5,true],[5.1,true]]"));
  EXPECT_THAT(TextOf("#notes ~ .card"), ::testing::HasSubstr("clock.csv: times are from 1700000000.000 s"));
  ExpectNothingIsCutOff();
  ExpectSoundPage();
}

}  // namespace
}  // namespace dexcheck::testing::judge_browser_test
