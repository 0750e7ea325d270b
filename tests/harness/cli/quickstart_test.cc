// Calls of harness/quickstart.sh to dexcheck, with a build and a program that only print their arguments.

#include <gtest/gtest.h>

#include "tests/common/paths.h"
#include "tests/common/run_program.h"

namespace dexcheck::testing::quickstart_test {
namespace {

namespace fs = std::filesystem;

class Quickstart : public ::testing::Test {
 protected:
  Quickstart() {
    WriteScript("harness/quickstart.sh", ReadText(SourcePath("/harness/quickstart.sh")));
    WriteScript("harness/install-packages.sh", "#!/bin/sh\n");
    WriteScript("bin/cmake", "#!/bin/sh\n");
    WriteScript("build/release/bin/dexcheck", "#!/bin/sh\necho \"$@\"\n");
  }

  /// The arguments of dexcheck.
  [[nodiscard]] std::string Run(const std::vector<std::string>& arguments) const {
    std::vector<std::string> command = {folder_.path() / "harness/quickstart.sh"};
    command.insert(command.end(), arguments.begin(), arguments.end());
    ProgramOptions options;
    options.environment = {{"PATH", (folder_.path() / "bin").string() + ":/usr/bin:/bin"}};
    const ProgramResult result = RunProgram(command, options);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
  }

 private:
  void WriteScript(const fs::path& name, const std::string& text) const {
    const fs::path path = folder_.path() / name;
    fs::create_directories(path.parent_path());
    WriteText(path, text);
    fs::permissions(path, fs::perms::owner_all);
  }

  TempFolder folder_;
};

TEST_F(Quickstart, RunsThePapersExperimentByDefault) {
  EXPECT_EQ(Run({}), "run paper\n");
  EXPECT_EQ(Run({"--set", "duration=1"}), "run paper --set duration=1\n");
  EXPECT_EQ(Run({"--quiet", "--out", "folder", "--seed", "3"}), "run paper --quiet --out folder --seed 3\n");
  EXPECT_EQ(Run({"--set=duration=1"}), "run paper --set=duration=1\n");
  EXPECT_EQ(Run({"curve", "--set", "duration=1"}), "run curve --set duration=1\n");
  EXPECT_EQ(Run({"--set", "duration=1", "curve"}), "run --set duration=1 curve\n");
  EXPECT_EQ(Run({"--list"}), "run --list\n");
  EXPECT_EQ(Run({"--replay", "folder"}), "run --replay folder\n");
}

}  // namespace
}  // namespace dexcheck::testing::quickstart_test
