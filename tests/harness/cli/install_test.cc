// An installed program finds its shipped files, also after its folder was moved.

#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::install_test {
namespace {

TEST(InstalledProgram, UsesTheFilesBesideIt) {
  const TempFolder folder;
  const std::filesystem::path first = folder.path() / "first";
  const ProgramResult install =
      RunProgram({DEXCHECK_CMAKE, "--install", BuildPath(), "--prefix", first.string()});
  ASSERT_EQ(install.exit_code, 0) << install.out << install.err;
  const std::filesystem::path prefix = folder.path() / "moved here";
  std::filesystem::rename(first, prefix);

  const std::vector<std::string> command = {prefix / "bin/dexcheck", "consistency", "--samples", "10"};
  const ProgramResult result = RunProgram({command[0], command[1], command[2], command[3], "--json", "-"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json results = Json::parse(result.out);
  const std::filesystem::path share = std::filesystem::canonical(prefix) / "share/dexcheck";
  EXPECT_EQ(results.at("robot"), (share / "controller/parameters/assistant_robot.toml").string());
  EXPECT_EQ(results.at("mjcf"), (share / "mjcf/scene.xml").string());
  for (const char* name : {"README.md", "controller/NOTATION.md", "harness/examples/paper_law.cc",
                           "harness/shipped/scenarios/README.md", "harness/shipped/scenarios/paper.toml"}) {
    EXPECT_TRUE(std::filesystem::exists(share / name)) << name;
  }

  // These files and no others: a change in them is noticed.
  const std::filesystem::path robot = share / "controller/parameters/assistant_robot.toml";
  WriteText(robot, ReplaceOnce(ReadText(robot), "L_7 = 0.25 ", "L_7 = 0.26 "));
  EXPECT_EQ(RunProgram(command).exit_code, 1);
}

TEST(InstalledProgram, RunsTheProgramsBesideIt) {
  const TempFolder folder;
  const std::filesystem::path prefix = folder.path() / "prefix";
  ASSERT_EQ(RunProgram({DEXCHECK_CMAKE, "--install", BuildPath(), "--component", "program", "--prefix",
                        prefix.string()})
                .exit_code,
            0);
  const std::filesystem::path gnuplot = prefix / "libexec/dexcheck/gnuplot";
  std::filesystem::create_directories(gnuplot.parent_path());
  WriteText(gnuplot, "#!/bin/sh\necho this is no gnuplot >&2\nexit 1\n");
  std::filesystem::permissions(gnuplot, std::filesystem::perms::owner_all);
  const ProgramResult result = RunProgram(
      {prefix / "bin/dexcheck", "run", "hold", "--set", "duration=0.02", "--out", folder.path() / "run"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr("could not draw the figures: this is no gnuplot"));
}

}  // namespace
}  // namespace dexcheck::testing::install_test
