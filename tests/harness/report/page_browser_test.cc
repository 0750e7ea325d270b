// The report's page in a browser.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "harness/report/page.h"
#include "harness/report/run_comparison.h"
#include "harness/report/run_data.h"
#include "renders/video.h"
#include "tests/common/browser.h"
#include "tests/common/files.h"
#include "tests/common/matchers.h"
#include "tests/harness/report/report_run.h"

namespace dexcheck::testing::page_browser_test {
namespace {

constexpr long kRows = 2001;
constexpr double kEnd = 2.0;              // s
constexpr double kPixelTolerance = 0.03;  // of the run: places in whole pixels of a plot some 450 wide
constexpr double kFloatTolerance = 1e-6;  // values are 4-byte floats

const char* const kAllDrawn =
    "const boxes = [...document.querySelectorAll('[data-plot]')]; return boxes.length > 0 && boxes.every(b "
    "=> b.chart);";

/// [from, to] of the plot with this number.
std::string AskRange(int plot) {
  return "const x = document.querySelectorAll('[data-plot]')[" + std::to_string(plot) +
         "].chart.scales.x;return [x.min, x.max];";
}

class PageBrowserTest : public ::testing::Test {
 protected:
  void SetUp() override {
    WriteReportRun(folder_.path(), {.rows = kRows});
    WriteRunReport(folder_.path(), MakeReportFiles(folder_.path()));
  }

  void ExpectVerdictInFirstView(int width, int height, bool mobile) {
    browser_.SetViewport(width, height, mobile);
    browser_.Open(folder_.path() / "report.html");
    const nlohmann::json place = browser_.Run(
        "const r = document.getElementById('verdict').getBoundingClientRect();return {bottom: r.bottom, "
        "height: r.height, text: document.getElementById('verdict').innerText,  scroll: scrollY, view: "
        "innerHeight, overflow: document.documentElement.scrollWidth - innerWidth};");
    EXPECT_EQ(place["scroll"], 0);
    EXPECT_GT(place["height"], 50.0);
    EXPECT_LT(place["bottom"], height) << width;
    EXPECT_LE(place["overflow"], 0) << width;
    EXPECT_THAT(place["text"].get<std::string>(), HasSubstr("DISAGREEMENT"));
    for (const char* part : {"Evidence: wheel_slip 0.004", "See it: wheel_slip fails from"})
      EXPECT_THAT(place["text"].get<std::string>(), HasSubstr(part));
  }

  /// A high window, so that all plots are in view and thus drawn.
  void OpenWithAllPlots() {
    browser_.SetViewport(1280, 9000);
    browser_.Open(folder_.path() / "report.html");
    ASSERT_TRUE(
        browser_.Run("for (const fold of document.querySelectorAll('.more')) fold.open = true; return true;")
            .get<bool>());
    ASSERT_TRUE(browser_.WaitFor(kAllDrawn));
  }

  void ExpectRange(int plot, double from, double to) const {
    const nlohmann::json range = browser_.Run(AskRange(plot));
    EXPECT_NEAR(range[0].get<double>(), from, kPixelTolerance * kEnd) << "plot " << plot;
    EXPECT_NEAR(range[1].get<double>(), to, kPixelTolerance * kEnd) << "plot " << plot;
  }

  void ExpectZoomAndReset() {
    const nlohmann::json area = browser_.Run(
        "const {canvas, chartArea: a} = document.querySelectorAll('[data-plot]')[0].chart,  r = "
        "canvas.getBoundingClientRect();return [r.x + a.left, r.y + a.top, a.width, "
        "a.height].map(Math.round);");
    const int x = area[0];
    const int y = area[1].get<int>() + area[3].get<int>() / 2;
    const int width = area[2];
    ASSERT_GT(width, 200);
    ExpectRange(0, 0.0, kEnd);
    browser_.Drag(x + width / 4, y, x + width / 2, y);
    ASSERT_TRUE(browser_.WaitFor(
        "const x = document.querySelectorAll('[data-plot]')[0].chart.scales.x;return x.max - x.min < 1;"));
    for (const int plot : {0, 1, 5}) ExpectRange(plot, 0.25 * kEnd, 0.5 * kEnd);
    browser_.DoubleClick(x + width / 2, y);
    for (const int plot : {0, 1, 5}) ExpectRange(plot, 0.0, kEnd);
  }

  TempFolder folder_;
  Browser& browser_ = Browser::Shared();
};

TEST_F(PageBrowserTest, ShowsVerdictAndPlotsWithoutErrors) {
  ExpectVerdictInFirstView(390, 844, true);
  ExpectVerdictInFirstView(1280, 720, false);
  OpenWithAllPlots();

  // The plots have the log's numbers: x actual and desired, near t = 1 s, where a row for each pixel is
  // drawn.
  const nlohmann::json points = browser_.Run(
      "const sets = [...document.querySelectorAll('[data-plot]')].find(box => "
      "box.textContent.includes('along "
      "x')).chart.data.datasets;return sets.map(set => set.data.find(point => point.x >= 1));");
  ASSERT_EQ(points.size(), 2);
  for (size_t k = 0; k < points.size(); ++k) {
    const double t = points[k]["x"];
    EXPECT_NEAR(t, 1.0, kPixelTolerance);
    EXPECT_NEAR(points[k]["y"].get<double>(), ReportObjectX(t) + 1e-3 * static_cast<double>(k),
                kFloatTolerance);
  }
  // Something was painted.
  EXPECT_GT(browser_
                .Run("const c = document.querySelector('.plot canvas');return "
                     "c.getContext('2d').getImageData(0, 0, c.width, c.height).data  .reduce((sum, value, i) "
                     "=> sum + (i % 4 === 3 && value > 0 ? 1 : 0), 0);")
                .get<int>(),
            500);
  ExpectZoomAndReset();

  // A name switches its curve off.
  EXPECT_EQ(browser_.Run("const box = document.querySelectorAll('[data-plot]')[0];box.querySelector('.keys "
                         "button').click();return [0, 1].map(k => box.chart.isDatasetVisible(k));"),
            nlohmann::json({false, true}));
  EXPECT_EQ(browser_.Run("return [0, 5e-5, 0.0669, 0.984, 0.997, 1, 1.5, 25, Infinity].map(ShowFraction);"),
            nlohmann::json(
                {"0", "< 0.01 %", "6.7 %", "98 %", "99.7 %", "100 %", "150 %", "25 ×", "beyond any bound"}));
  EXPECT_EQ(browser_.Run("const row = [...document.querySelectorAll('.checks tr')].find(row => "
                         "row.innerHTML.includes('wheel_slip'));return [row.className, "
                         "row.children[2].textContent, row.children[4].textContent];"),
            nlohmann::json({"fail", "4.0e-3 m", "400 %"}));
  // No id stands twice, and nothing was loaded.
  EXPECT_EQ(browser_.CountRepeatedIds(), 0);
  EXPECT_EQ(browser_.CountLoaded(), 0);

  const std::string ask_ground = "return getComputedStyle(document.body).backgroundColor;";
  const nlohmann::json light = browser_.Run(ask_ground);
  browser_.SetDark(true);
  EXPECT_NE(browser_.Run(ask_ground), light);
  EXPECT_GT(browser_.WorkControls(), 10);
  EXPECT_THAT(browser_.TakeConsole(), IsEmpty());
}

// A video of one second, as `dexcheck run --video` encodes it: red, from the middle on blue.
void WriteVideo(const std::filesystem::path& path) {
  EncodingOptions options;
  options.width = 160;
  options.height = 90;
  VideoWriter video(path, options);
  Image image(options.width, options.height);
  for (int frame = 0; frame < options.fps; ++frame) {
    for (size_t i = 0; i < image.rgb.size(); ++i) {
      const bool lit = i % 3 == (frame < options.fps / 2 ? 0U : 2U);
      image.rgb[i] = lit ? 200 : 20;
    }
    video.Write(image);
  }
  video.Finish();
}

// Makes a page without the replay, which would compete for the processor.
RunScene MakeNoScene(const RunData& /*run*/, const std::filesystem::path& /*folder*/) { return {}; }

TEST_F(PageBrowserTest, NoTileIsNarrowerThanItsWords) {
  browser_.Open(folder_.path() / "report.html");
  for (const int width : {360, 641, 850, 1300, 2560}) {
    browser_.SetViewport(width, 900, false);
    ASSERT_GE(browser_.Run("return document.querySelectorAll('.category b').length;"), 1);
    EXPECT_EQ(browser_.Run("return [...document.querySelectorAll('.tiles b')]  .filter(b => b.scrollWidth > "
                           "b.clientWidth).map(b => b.textContent);"),
              nlohmann::json::array())
        << width;
  }
}

// A table that is wider than its card can be scrolled.
TEST_F(PageBrowserTest, AComparisonsTablesStayInTheirCards) {
  const RunData run(folder_.path());
  const std::filesystem::path file = folder_.path() / "comparison.html";
  std::ofstream(file) << MakeComparisonPage({&run, &run}, {"one", "another"}, CompareRuns({&run, &run}, {}));
  browser_.Open(file);
  for (const int width : {360, 800, 1300}) {
    browser_.SetViewport(width, 900, false);
    ASSERT_GE(browser_.Run("return document.querySelectorAll('.card table').length;"), 2);
    EXPECT_EQ(
        browser_.Run(
            "return [...document.querySelectorAll('.card')]  .filter(c => c.scrollWidth > c.clientWidth && "
            "getComputedStyle(c).overflowX !== 'auto').map(c => c.innerText.slice(0, 40));"),
        nlohmann::json::array())
        << width;
  }
  EXPECT_GE(browser_.Run("return document.querySelectorAll('#checks + .card details tr').length;"), 2)
      << "constants that agree are folded";
  EXPECT_GT(browser_.WorkControls(), 2);
}

// The confusion matrix counts what each fault was named.
TEST_F(PageBrowserTest, ACampaignsPageHasItsMatrix) {
  const auto fault = [](const char* outcome, const char* injected, const char* named) {
    nlohmann::ordered_json one = {{"kind", "motor"},
                                  {"name", injected},
                                  {"outcome", outcome},
                                  {"cause_right", true},
                                  {"causes", "</script>"}};
    if (*named != '\0') one["names"] = {{{"injected", injected}, {"place", "motor a"}, {"named", named}}};
    return one;
  };
  const nlohmann::ordered_json campaign = {
      {"scenario", "curve"},
      {"faults",
       {fault("found", "gain", "gain"), fault("found", "gain", "a class"),
        fault("found", "signal of motor b, gain", "lag"), fault("survived", "offset", "")}}};
  const std::filesystem::path file = folder_.path() / "campaign.html";
  std::ofstream(file) << MakeCampaignPage(campaign);
  browser_.Open(file);
  EXPECT_EQ(browser_.Run("return document.querySelector('#verdict strong').textContent;"), "SURVIVORS");
  EXPECT_EQ(browser_.Run("return [...document.querySelectorAll('.matrix tr')].map(row => "
                         "[...row.children].map(cell => cell.textContent).join('|'));"),
            nlohmann::json({"injected|gain|lag|a class|all", "gain|1||1|2", "signal of another one||1||1"}));
  EXPECT_GE(browser_.WorkControls(), 0);
}

TEST_F(PageBrowserTest, PlaysTheVideo) {
  WriteVideo(folder_.path() / "video.mp4");
  WriteRunReport(folder_.path(), MakeReportFiles(folder_.path()), MakeNoScene);
  browser_.SetViewport(1280, 720);
  browser_.Open(folder_.path() / "report.html");
  const std::string video = "const video = document.querySelector('video');";
  ASSERT_TRUE(browser_.WaitFor(video + "return video.readyState >= HTMLMediaElement.HAVE_CURRENT_DATA;"))
      << browser_.Run(video + "return [video.readyState, video.error && video.error.message];");
  const nlohmann::json size =
      browser_.Run(video + "return [video.videoWidth, video.videoHeight, video.duration];");
  EXPECT_EQ(size[0], 160);
  EXPECT_EQ(size[1], 90);
  EXPECT_NEAR(size[2].get<double>(), 1.0, 0.01);
  // Nothing is painted of a video that is out of view.
  EXPECT_TRUE(browser_.Run(video + "video.scrollIntoView();").is_null());
  // Red, green and blue of a pixel as it is painted.
  const std::string paint =
      video +
      "const canvas = document.createElement('canvas'); canvas.width = 160; canvas.height = 90;const context "
      "= canvas.getContext('2d', {willReadFrequently: true}); context.drawImage(video, 0, 0);const pixel = "
      "context.getImageData(80, 45, 1, 1).data;";
  EXPECT_TRUE(browser_.WaitFor(paint + "return pixel[0] > 150 && pixel[2] < 80;"))
      << "red at first, not " << browser_.Run(paint + "return [...pixel];");
  EXPECT_TRUE(browser_.Run(video + "video.muted = true; video.play();").is_null());
  EXPECT_TRUE(browser_.WaitFor(video + "return video.currentTime > 0.7;"));
  EXPECT_TRUE(browser_.WaitFor(paint + "return pixel[0] < 80 && pixel[2] > 150;")) << "blue at the end";
  EXPECT_THAT(browser_.TakeConsole(), IsEmpty());
}

TEST_F(PageBrowserTest, WouldNoticeAVideoThatCannotBePlayed) {
  WriteText(folder_.path() / "video.mp4", "no video");
  WriteRunReport(folder_.path(), MakeReportFiles(folder_.path()), MakeNoScene);
  browser_.Open(folder_.path() / "report.html");
  EXPECT_TRUE(
      browser_.WaitFor("const video = document.querySelector('video');return video.error !== null && "
                       "video.readyState === 0;"));
}

TEST_F(PageBrowserTest, WouldNoticeErrors) {
  std::string page = ReadText(folder_.path() / "report.html");
  const std::string end = "</body>";
  page.insert(page.rfind(end),
              "<script>noSuchFunction();</script><img src=\"https://example.invalid/x.png\">");
  WriteText(folder_.path() / "report.html", page);
  browser_.Open(folder_.path() / "report.html");
  EXPECT_THAT(browser_.TakeConsole(), AllOf(Not(IsEmpty()), ::testing::SizeIs(2)));
}

}  // namespace
}  // namespace dexcheck::testing::page_browser_test
