// Contents of a report's files.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "harness/report/page.h"
#include "harness/report/run_data.h"
#include "tests/common/files.h"
#include "tests/common/matchers.h"
#include "tests/harness/report/report_run.h"

namespace dexcheck::testing::write_report_test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// Returns the data of the page.
Json ReadData(const std::string& page) {
  const std::string begin = "id=\"run-page\">";
  const size_t at = page.find(begin) + begin.size();
  return Json::parse(page.substr(at, page.find("</script>", at) - at));
}

std::vector<std::string> SplitLines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

class WriteReportTest : public ::testing::Test {
 protected:
  /// Writes a run and its report; returns the page.
  std::string Report(const ReportRun& run = {}) {
    WriteReportRun(run_dir(), run);
    WriteRunReport(run_dir(), MakeReportFiles(run_dir()));
    return ReadText(run_dir() / "report.html");
  }
  [[nodiscard]] fs::path run_dir() const { return folder_.path() / "run"; }
  [[nodiscard]] std::set<std::string> ListFiles() const {
    std::set<std::string> names;
    for (const fs::directory_entry& entry : fs::directory_iterator(run_dir())) {
      names.insert(entry.path().filename().string());
    }
    return names;
  }

 private:
  TempFolder folder_;
};

TEST_F(WriteReportTest, HasThePapersPanelsFromTheRightSignals) {
  WriteReportRun(run_dir());
  const RunData run(run_dir());
  const std::vector<Figure> figures = MakeMotionFigures(run);
  std::map<std::string, std::vector<std::string>> labels;
  for (const Figure& figure : figures) {
    for (const Curve& curve : figure.curves) labels[figure.name].push_back(curve.label);
  }
  EXPECT_THAT(labels["fig12a"], ElementsAre("x actual", "x desired"));
  EXPECT_THAT(labels["fig12c"], ElementsAre("x_c (m)", "y_c (m)", "φ (rad)"));
  EXPECT_THAT(labels["fig12d"], ElementsAre("rf1_1", "rf1_2"));
  EXPECT_THAT(labels["fig12e"], ElementsAre("l_elbow"));
  EXPECT_THAT(labels["fig12f"], ElementsAre("wheel_right", "waist_yaw", "r_elbow"));
  EXPECT_THAT(labels["idle_finger_torques"], ElementsAre("lf1_1"));
  EXPECT_THAT(labels["other_torques"], ElementsAre("tail"));
  EXPECT_EQ(labels["fig12b"].size(), 10U);
  for (const Figure& figure : figures) {
    if (figure.name != "fig13a") continue;
    EXPECT_EQ(figure.curves[0].values[3], 2.0);
    EXPECT_DOUBLE_EQ(figure.curves[1].values[3], 0.5);  // hypot(0.3, 0.4)
    EXPECT_EQ(figure.curves[2].values[3], 1.0);         // mu 0.5
  }
  EXPECT_EQ(labels["fig13a"].size(), 3U);
}

// A humanoid has a waist, too.
TEST_F(WriteReportTest, PanelsAreThoseOfThePapersRobotAlone) {
  WriteReportRun(run_dir(), {.has_wheels = false});
  std::map<std::string, size_t> curves;
  for (const Figure& figure : MakeMotionFigures(RunData(run_dir())))
    curves[figure.name] = figure.curves.size();
  EXPECT_EQ(curves["fig12f"], 0U);
  EXPECT_EQ(curves["other_torques"], 5U);
}

TEST_F(WriteReportTest, ShowsTheOptimalForcesBesideTheMeasuredOnes) {
  WriteReportRun(run_dir(), {.has_law = true});
  const std::vector<Figure> figures = MakeMotionFigures(RunData(run_dir()));
  const auto figure = std::ranges::find(figures, "fig13a", &Figure::name);
  ASSERT_NE(figure, figures.end());
  std::vector<std::string> labels;
  for (const Curve& curve : figure->curves) labels.push_back(curve.label);
  ASSERT_THAT(labels, ElementsAre("normal, measured", "tangential, measured", "normal, optimal (49)",
                                  "tangential, optimal (49)", "friction cone: μ × normal"));
  EXPECT_EQ(figure->curves[0].values[3], 2.0);
  EXPECT_EQ(figure->curves[2].values[3], 2.5);
  EXPECT_EQ(figure->curves[3].values[3], 0.0);
}

TEST_F(WriteReportTest, DrawsResidualsAsFractionsOfTheirBounds) {
  WriteReportRun(run_dir());
  const std::vector<Figure> figures = MakeResidualFigures(RunData(run_dir()));
  ASSERT_EQ(figures.size(), 4U);
  EXPECT_EQ(figures[1].name, "residual_inverse_dynamics");
  EXPECT_TRUE(figures[1].log);
  EXPECT_EQ(figures[1].bound, 1.0);
  EXPECT_DOUBLE_EQ(figures[1].curves.at(0).values[0], 0.5);
  EXPECT_DOUBLE_EQ(figures[3].curves.at(0).values[399], 4.0);
}

TEST_F(WriteReportTest, PutsFailedChecksFirstThenTheNearestToTheirBounds) {
  WriteReportRun(run_dir());
  const RunData run(run_dir());
  std::vector<std::string> names;
  for (const CheckRecord& check : run.checks()) names.push_back(check.name);
  EXPECT_THAT(names,
              ElementsAre("wheel_slip", "inverse_dynamics_robot", "M_bar", "contact_force", "link_mass"));
  EXPECT_TRUE(run.checks()[0].failed);
  EXPECT_FALSE(IsTimed(run.checks()[4]));
}

TEST_F(WriteReportTest, WritesPageAndFiguresAndLeavesNothingElse) {
  const std::string page = Report();
  EXPECT_THAT(ListFiles(), ElementsAre("figures", "log.h5", "report.html"));
  for (const char* name :
       {"fig12a", "fig12b", "fig12c", "fig12d", "fig12e", "fig12f", "fig13a", "tracking_error",
        "residual_model", "residual_inverse_dynamics", "residual_forward_dynamics", "residual_assumption"}) {
    for (const auto& [extension, beginning] :
         {std::pair(".pdf", "%PDF"), std::pair(".png", "\x89PNG"), std::pair(".csv", "t (s),\"")}) {
      const fs::path file = run_dir() / "figures" / (std::string(name) + extension);
      EXPECT_THAT(ReadText(file), StartsWith(beginning)) << file;
    }
  }
}

TEST_F(WriteReportTest, FiguresHaveTheirFontsAndTheNumbersThatTheyShow) {
  Report();
  EXPECT_THAT(ReadText(run_dir() / "figures/fig12a.pdf"), HasSubstr("/FontFile"));
  const std::vector<std::string> lines = SplitLines(ReadText(run_dir() / "figures/fig12a.csv"));
  ASSERT_EQ(lines.size(), 401U);
  EXPECT_EQ(lines[0], "t (s),\"x actual, x (m)\",\"x desired, x (m)\"");
  EXPECT_EQ(lines[101], "0.1,0.6,0.601");
  // No logarithm shows a residual of 0.
  EXPECT_THAT(SplitLines(ReadText(run_dir() / "figures/residual_model.csv"))[8], HasSubstr("0.007,NaN"));
}

/// The cells of a table's rows. Fails for braces or environments that do not pair.
std::vector<std::vector<std::string>> ReadTexRows(const std::string& table) {
  std::vector<std::string> open;
  long braces = 0;
  for (size_t i = 0; i < table.size(); ++i) {
    if (table[i] == '\\' && !std::isalpha(table[i + 1])) {
      ++i;
    } else if (table[i] == '{' || table[i] == '}') {
      EXPECT_GE(braces += table[i] == '{' ? 1 : -1, 0);
    }
  }
  EXPECT_EQ(braces, 0);
  std::vector<std::vector<std::string>> rows;
  for (const std::string& line : SplitLines(table)) {
    const std::string text = line.substr(std::min(line.find_first_not_of(' '), line.size()));
    if (text.starts_with("\\begin{")) open.push_back(text.substr(7, text.find('}') - 6));
    if (text.starts_with("\\end{")) {
      EXPECT_TRUE(!open.empty() && text.substr(5) == open.back()) << text;
      open.pop_back();
    }
    if (!text.ends_with(" \\\\")) continue;
    rows.emplace_back();
    std::istringstream cells(text.substr(0, text.size() - 3));
    for (std::string cell; std::getline(cells, cell, '&');) rows.back().push_back(cell);
  }
  EXPECT_TRUE(open.empty());
  return rows;
}

TEST_F(WriteReportTest, TheTableForLatexHasResultsCommitAndCommand) {
  WriteReportRun(run_dir(), {.scenario = "50%_{of}\\it^2"});
  const std::string table = MakeTexTable(RunData(run_dir()));
  const auto rows = ReadTexRows(table);
  ASSERT_EQ(rows.size(), 7U) << table;
  for (const auto& row : rows) EXPECT_EQ(row.size(), 5U) << table;
  EXPECT_THAT(rows[2], ElementsAre("tracking ", " position error max ", " $0.001$ ", "  ", " m"));
  EXPECT_THAT(rows[3], ElementsAre("model (2) ", " \\texttt{M\\_bar} ", " $1\\times10^{-16}$ ",
                                   " $1\\times10^{-13}$ ", " 1"));
  EXPECT_THAT(rows[6][1], HasSubstr("wheel\\_slip} \\textbf{fails}"));
  EXPECT_THAT(table, HasSubstr("\\texttt{50\\%\\_\\{of\\}\\textbackslash{}it\\textsuperscript 2}"));
  EXPECT_THAT(table, HasSubstr("disagreement after 400 steps"));
  EXPECT_THAT(table, HasSubstr("dexcheck run sample --set 'a=<b>'"));
  EXPECT_THAT(table, HasSubstr("commit \\texttt{0123abc-dirty}"));
}

TEST_F(WriteReportTest, SaysVerdictCauseAndWhatWasRun) {
  const Json page = ReadData(Report());
  EXPECT_EQ(page["verdict"]["word"], "DISAGREEMENT");
  EXPECT_EQ(page["summary"]["attribution"]["cause"], "wheel slip");
  EXPECT_EQ(page["summary"]["attribution"]["evidence"], "wheel_slip 0.004 (bound 0.001)");
  std::map<std::string, Json> checks;
  for (const Json& category : page["categories"]) {
    for (const Json& check : category["checks"]) checks[check["name"]] = check;
  }
  EXPECT_NEAR(checks["wheel_slip"]["failed_at_s"], 0.133, 5e-4);
  EXPECT_THAT(checks["inverse_dynamics_robot"]["description"].get<std::string>(),
              HasSubstr("what inverse_dynamics_robot is"));
  EXPECT_THAT(page["texts"]["command"].get<std::string>(), HasSubstr("a=<b>"));
  EXPECT_EQ(page["texts"]["overrides"], "duration=0.4\nmu=0.5\n");
  EXPECT_EQ(page["texts"]["mujoco_version"], "2.2.2");
  EXPECT_EQ(page["texts"]["dexcheck_version"], "0.0.1");
}

TEST_F(WriteReportTest, NothingOfTheLogIsMarkup) {
  const std::string scenario = "<i>'sample'</i>";
  const std::string page = Report({.scenario = scenario});
  EXPECT_THAT(page, Not(HasSubstr("<script>alert")));
  EXPECT_THAT(page, Not(HasSubstr("<i>'sample'")));
  EXPECT_EQ(ReadData(page)["scenario"], scenario);
  EXPECT_THAT(ReadData(page)["summary"]["description"].get<std::string>(),
              HasSubstr("made <by> hand & \"quoted\""));
}

TEST_F(WriteReportTest, IsTheSameWhenMadeAgain) {
  const std::string page = Report();
  WriteRunReport(run_dir(), MakeReportFiles(run_dir()));
  EXPECT_TRUE(ReadText(run_dir() / "report.html") == page);
}

TEST_F(WriteReportTest, GivesNoVerdictForARunThatWasCutOff) {
  const Json page = ReadData(Report({.has_summary = false}));
  EXPECT_EQ(page["verdict"]["word"], "NO VERDICT");
  // From the recorded values themselves.
  for (const Json& check : page["categories"].back()["checks"])
    if (check["name"] == "wheel_slip") EXPECT_NEAR(check["failed_at_s"], 0.133, 5e-4);
  EXPECT_FALSE(page["categories"].back()["checks"].empty());
}

TEST_F(WriteReportTest, EmbedsASmallVideoAndLinksToALargeOne) {
  WriteReportRun(run_dir());
  WriteText(run_dir() / "video.mp4", "foobar");
  WriteRunReport(run_dir(), MakeReportFiles(run_dir()));
  const std::string embedded = "id=\"run-video\">Zm9vYmFy<";
  EXPECT_THAT(ReadText(run_dir() / "report.html"), HasSubstr(embedded));
  fs::resize_file(run_dir() / "video.mp4", 20'000'001);
  WriteRunReport(run_dir(), MakeReportFiles(run_dir()));
  const std::string page = ReadText(run_dir() / "report.html");
  EXPECT_EQ(ReadData(page)["video"]["link"], "video.mp4");
  EXPECT_THAT(page, Not(HasSubstr("id=\"run-video\"")));
  EXPECT_LT(page.size(), 6'000'000U);
}

TEST_F(WriteReportTest, AddsPicturesFromElsewhere) {
  WriteReportRun(run_dir());
  WriteRunReport(run_dir(), MakeReportFiles(run_dir()), [](const RunData&, const fs::path& folder) {
    WriteText(folder / "fig11a.png", "foobar");
    return RunScene{{{folder / "fig11a.png", "11 (a)", "Beginning"}}, {}};
  });
  EXPECT_THAT(ReadText(run_dir() / "report.html"), HasSubstr("id=\"run-picture-0\">Zm9vYmFy<"));
  EXPECT_EQ(ReadText(run_dir() / "figures/fig11a.png"), "foobar");
}

TEST_F(WriteReportTest, KeepsWhatWasThereWhenPicturesFail) {
  WriteReportRun(run_dir());
  WriteText(run_dir() / "report.html", "old");
  const SceneMaker fail = [](const RunData&, const fs::path&) -> RunScene {
    throw InputError("no pictures");
  };
  EXPECT_THROW(WriteRunReport(run_dir(), MakeReportFiles(run_dir()), fail), InputError);
  EXPECT_EQ(ReadText(run_dir() / "report.html"), "old");
  EXPECT_THAT(ListFiles(), ElementsAre("log.h5", "report.html"));
}

TEST_F(WriteReportTest, StaysSmallForALongRun) { EXPECT_LT(Report({.rows = 60000}).size(), 6'000'000U); }

TEST(Figures, CurvesOfTwoAxesDoNotLieOnOneAnother) {
  Figure figure;
  figure.least_span = 0.02;
  figure.label = "position (m)";
  figure.curves = {{"y", VectorXd::Constant(3, -0.22)}, {"z", VectorXd::Constant(3, 0.73)}};
  const auto fraction = [&](double value, bool right) {
    const std::array<double, 2> range = CalcAxisRange(figure, right);
    return (value - range[0]) / (range[1] - range[0]);
  };
  EXPECT_LT(fraction(-0.22, false), 0.1) << "one axis is filled";
  EXPECT_GT(fraction(0.73, false), 0.9);
  figure.right_label = "angle (rad)";
  for (const double angle : {-1.57, 0.0, 1.83}) {
    figure.curves.push_back({"angle", VectorXd::Constant(3, angle), 2, 0, true});
  }
  EXPECT_GT(fraction(-0.22, false), 0.5);
  EXPECT_LT(fraction(0.73, false), 1.0);
  EXPECT_GT(fraction(-1.57, true), 0.0);
  EXPECT_LT(fraction(1.83, true), 0.5);
}

}  // namespace
}  // namespace dexcheck::testing::write_report_test
