// The page of two files in a browser.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/common/browser.h"
#include "tests/common/files.h"
#include "tests/common/paths.h"
#include "tests/common/run_program.h"

namespace dexcheck::testing::files_page_browser_test {
namespace {

/// Largest distance between the places of two robots' parts that both have, with all joints turned by 0.5
/// rad.
constexpr const char* kDistances =
    "const {built, pose} = document.querySelector('#replay').robots; pose(0.5);"
    "for (const {group} of built) group.updateMatrixWorld(true);"
    "const at = (robot, name) => robot.parts.find(({link}) => link.name === name).moved;"
    "const place = (part, p) => { const v = part.position.clone().set(...p); return part.localToWorld(v); };"
    "return built[0].parts.filter(({link}) => link.ellipsoid).map(({link, moved}) => {"
    "  const other = at(built[1], link.name), it = built[1].parts.find(one => one.moved === other).link;"
    "  return [link.name, place(moved, link.ellipsoid.position).distanceTo(place(other, "
    "it.ellipsoid.position))];"
    "});";

class FilesPageBrowserTest : public ::testing::Test {
 protected:
  void Open(const std::string& a, const std::string& b) {
    const std::string page = folder_.path() / "page.html";
    const ProgramResult result = RunProgram({ProgramPath(), a, b, "--page", page, "--quiet"});
    EXPECT_THAT(result.out, ::testing::HasSubstr("page: " + page)) << result.err;
    browser_.Open(page);
  }
  void ExpectSoundPage() {
    for (const int width : {360, 768, 1280}) {
      browser_.SetViewport(width, 900, false);
      EXPECT_LE(browser_.Run("return document.documentElement.scrollWidth - innerWidth;"), 0) << width;
    }
    EXPECT_GT(browser_.WorkControls(), 3);
    EXPECT_EQ(browser_.CountRepeatedIds(), 0);
    EXPECT_EQ(browser_.CountLoaded(), 0);
  }
  [[nodiscard]] std::string TextOf(const std::string& selector) const {
    return browser_.Run("return document.querySelector('" + selector + "').innerText;");
  }

  TempFolder folder_;
  Browser& browser_ = Browser::Shared();
};

TEST_F(FilesPageBrowserTest, RobotsThatAgreeLieOverEachOther) {
  Open(SourcePath("/controller/parameters/panda.toml"), SourcePath("/mjcf/panda.xml"));
  EXPECT_THAT(TextOf("#verdict"), ::testing::HasSubstr("AGREE"));
  const nlohmann::json distances = browser_.Run(kDistances);
  EXPECT_GE(distances.size(), 7);
  for (const auto& one : distances) EXPECT_LT(one[1], 1e-12) << one;
  ExpectSoundPage();
}

TEST_F(FilesPageBrowserTest, CausesAreListedAndTheirLinksMarked) {
  std::string text = ReadText(SourcePath("/harness/examples/tutorial/arm.xml"));
  const std::string axis = R"(name="elbow")", mass = R"(mass="1.2")";
  text.replace(text.find(axis), axis.size(), axis + R"( axis="0 1 0")");
  text.replace(text.find(mass), mass.size(), R"(mass="1.5")");
  WriteText(folder_.path() / "other.xml", text);
  Open(SourcePath("/harness/examples/tutorial/arm.toml"), folder_.path() / "other.xml");
  EXPECT_THAT(TextOf("#verdict"), ::testing::HasSubstr("DISAGREE"));
  const nlohmann::json causes =
      browser_.Run("return [...document.querySelectorAll('.causes button')].map(b => b.textContent);");
  EXPECT_THAT(causes.get<std::vector<std::string>>(),
              ::testing::UnorderedElementsAre(::testing::HasSubstr("joint elbow: axis"),
                                              ::testing::HasSubstr("link hand: mass")));
  // The wrong axis turns the elbow the other way; nothing above it moves otherwise.
  const nlohmann::json distances = browser_.Run(kDistances);
  for (const auto& one : distances) {
    EXPECT_EQ(one[1].get<double>() > 1e-12, one[0] == "lower" || one[0] == "hand") << one;
  }
  ExpectSoundPage();
}

}  // namespace
}  // namespace dexcheck::testing::files_page_browser_test
