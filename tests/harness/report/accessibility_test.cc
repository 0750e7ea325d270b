// The page of a run as axe-core judges it: contrast, names of controls, alternative texts, keyboard.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <random>
#include <string>

#include "harness/report/page.h"
#include "tests/common/browser.h"
#include "tests/common/paths.h"
#include "tests/common/run_program.h"
#include "tests/harness/recordings/recorded_robot.h"
#include "tests/harness/report/replay_run.h"

namespace dexcheck::testing::accessibility_test {
namespace {

/// Everything unfolded; what axe finds comes as one line each.
constexpr const char* kAsk =
    "for (const fold of document.querySelectorAll('details')) fold.open = true;window.found = null; "
    "axe.run({resultTypes: ['violations']}).then(r => { window.found = r.violations.map(v => `${v.id} "
    "(${v.impact}), ${v.nodes.length} times: ${v.nodes[0].target} ${v.nodes[0].failureSummary}`); });";

class AccessibilityBrowserTest : public ::testing::Test {
 protected:
  /// axe-core's script from the npm registry; empty without a network.
  std::string FetchAxe() {
    const ProgramResult result = RunProgram({"/usr/bin/env", "npm", "install", "--silent", "--no-audit",
                                             "--prefix", folder_.path().string(), "axe-core@4"});
    const std::filesystem::path script = folder_.path() / "node_modules/axe-core/axe.min.js";
    return result.exit_code == 0 && std::filesystem::exists(script) ? ReadText(script) : "";
  }
  /// Light and dark.
  static void ExpectNothingFound(const std::string& axe, const std::filesystem::path& page,
                                 Browser* browser) {
    browser->SetViewport(900, 420);
    for (const bool dark : {false, true}) {
      browser->SetDark(dark);
      browser->Open(page);
      (void)browser->Run(axe + "; return 0;");
      (void)browser->Run(kAsk);
      ASSERT_TRUE(browser->WaitFor("return window.found !== null;", 60.0));
      EXPECT_EQ(browser->Run("return window.found;"), nlohmann::json::array()) << (dark ? "dark" : "light");
    }
  }
  TempFolder folder_;
};

TEST_F(AccessibilityBrowserTest, AxeFindsNothingInThePageOfARun) {
  const std::string axe = FetchAxe();
  if (axe.empty()) GTEST_SKIP() << "axe-core cannot be fetched from the npm registry";
  WriteReplayRun(folder_.path(), 0.3);
  WriteRunReport(folder_.path(), MakeReportFiles(folder_.path()));
  Browser browser;
  ExpectNothingFound(axe, folder_.path() / "report.html", &browser);
  // It can find something: a picture without a text, grey on grey.
  (void)browser.Run(
      "document.body.insertAdjacentHTML('beforeend', '<img src=\"data:,\"><p style=\"color: #777; "
      "background: #888\">faint</p>');");
  (void)browser.Run(kAsk);
  ASSERT_TRUE(browser.WaitFor("return window.found !== null;", 60.0));
  const std::string found = browser.Run("return window.found;").dump();
  EXPECT_THAT(found,
              ::testing::AllOf(::testing::HasSubstr("image-alt"), ::testing::HasSubstr("color-contrast")));
}

TEST_F(AccessibilityBrowserTest, AxeFindsNothingInThePageOfARecording) {
  const std::string axe = FetchAxe();
  if (axe.empty()) GTEST_SKIP() << "axe-core cannot be fetched from the npm registry";
  std::mt19937 random(6);
  RecordingOptions options;
  options.duration = 10.0;
  const RecordedFault friction = {"dry friction", "joint panda_joint4", 2.0,
                                  [](mjModel* robot) { robot->dof_frictionloss[3] = 2.0; }};
  const std::filesystem::path recording = folder_.path() / "recording.csv",
                              page = folder_.path() / "judged.html";
  WriteCsv(RecordRobot("mjcf/panda.xml", {friction}, options, &random), recording);
  const ProgramResult result =
      RunProgram({ProgramPath(), "judge", SourcePath("/controller/parameters/panda.toml"), recording.string(),
                  "--page", page.string()});
  ASSERT_EQ(result.exit_code, 1) << result.err;
  Browser browser;
  ExpectNothingFound(axe, page, &browser);
}

}  // namespace
}  // namespace dexcheck::testing::accessibility_test
