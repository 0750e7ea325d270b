// The command line itself: usage errors, help, and outputs that cannot be written.

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <algorithm>
#include <map>
#include <regex>
#include <sstream>

#include "tests/common/matchers.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::usage_test {
namespace {

TEST(Usage, UnknownWordsAreNamed) {
  EXPECT_TRUE(IsRefused(RunDexcheck({}), {"A subcommand is required"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"simulate"}), {"unknown command \"simulate\""}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"consistancy"}), {"\"consistancy\"", "did you mean \"consistency\"?"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"consistency", "--sample", "3"}),
                        {"unknown option \"--sample\"", "did you mean \"--samples\"?"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"mutate", "panda.toml"}), {"unknown argument \"panda.toml\""}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"consistency", "--quiet=maybe"}), {"quiet", "maybe"}));
}

TEST(Usage, NumbersOfSamplesAreWholeAndPositive) {
  for (const char* samples : {"0", "-3", "abc", "", "2.5", "1e3", "0x10", " 7", "99999999999999999999"}) {
    EXPECT_TRUE(IsRefused(
        RunDexcheck({"consistency", "--samples", samples}),
        {"--samples: must be a whole number from 1 to 1000000000, got \"" + std::string(samples) + "\""}));
  }
  for (const char* seed : {"-1", "abc", "18446744073709551616"}) {
    EXPECT_TRUE(IsRefused(RunDexcheck({"consistency", "--seed", seed}),
                          {"--seed: must be a whole number", "got \"" + std::string(seed) + "\""}));
  }
  EXPECT_TRUE(IsRefused(RunDexcheck({"consistency", "--samples"}), {"--samples"}));
}

TEST(Usage, RobotAndMjcfBelongTogether) {
  const std::string robot = testing::kParameters + "panda.toml";
  const std::string mjcf = testing::kMjcf + "panda.xml";
  EXPECT_TRUE(IsRefused(RunDexcheck({"consistency", "--robot", robot}), {"--robot requires --mjcf"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"consistency", "--mjcf", mjcf}), {"--mjcf requires --robot"}));
  EXPECT_TRUE(
      IsRefused(RunDexcheck({"eval", "--state", "s.json", "--mjcf", mjcf}), {"--mjcf requires --robot"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"eval"}), {"--state is required"}));
}

TEST(Usage, HelpMentionsEveryCommandAndOption) {
  const auto help = [](const std::vector<std::string>& arguments) {
    const testing::ProgramResult result = RunDexcheck(arguments);
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_EQ(result.err, "");
    return result.out;
  };
  for (const char* word : {"consistency", "eval", "export", "render", "--help", "--version",
                           "\nCompare descriptions:", "\nRun and look:", "\nStudy:", "\nSet up:"}) {
    EXPECT_THAT(help({"--help"}), HasSubstr(word));
  }
  for (const char* word : {"--robot FILE.toml", "--mjcf FILE.xml", "--samples N=10000", "--seed N=1",
                           "--json [FILE.json]", "--quiet"}) {
    EXPECT_THAT(help({"consistency", "--help"}), HasSubstr(word));
  }
  for (const char* word :
       {"--robot FILE.toml", "--mjcf FILE.xml", "--state STATE.json REQUIRED", "--out FILE.json=-"}) {
    EXPECT_THAT(help({"eval", "--help"}), HasSubstr(word));
  }
  for (const char* word : {"--contacts REQUIRED", "--object-xyz X Y Z x 3 REQUIRED", "--hand right|left",
                           "--palm FRAME", "--support-height Z", "--mu MU=0.5", "--json [FILE.json]"}) {
    EXPECT_THAT(help({"plan", "--help"}), HasSubstr(word));
  }
  for (const char* word : {"RUN_DIR", "--csv FILE.csv", "--signals A,B,...", "--every N=1", "--list"}) {
    EXPECT_THAT(help({"export", "--help"}), HasSubstr(word));
  }
  for (const char* word :
       {"RUN_DIR REQUIRED", "--out FILE", "--still T", "--camera NAME", "overview (the default)",
        "--inset NAME", "--beside RUN_DIR", "--size WxH=1280x720", "--fps N=30", "--jobs N", "--forces",
        "--tracks", "--frames", "--no-panel", "--quiet"}) {
    EXPECT_THAT(help({"render", "--help"}), HasSubstr(word));
  }
  EXPECT_THAT(help({"--version"}), ::testing::MatchesRegex("[0-9]+\\.[0-9]+\\.[0-9]+\n"));
}

TEST(Usage, TwoRobotsAreComparedWithoutTheWordForIt) {
  const std::vector<std::string> words = {testing::kParameters + "panda.toml", testing::kMjcf + "panda.xml",
                                          "--samples", "2", "--json"};
  std::vector<std::string> whole = words;
  whole.insert(whole.begin(), "consistency");
  const testing::ProgramResult result = RunDexcheck(words);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out, RunDexcheck(whole).out);
  EXPECT_TRUE(IsRefused(RunDexcheck({words[0]}), {"unknown command"}));
}

/// The words of a command that --help lists under a title.
std::vector<std::string> ListCommands(const std::vector<std::string>& command) {
  std::vector<std::string> arguments = command;
  arguments.emplace_back("--help");
  std::istringstream help(RunDexcheck(arguments).out);
  std::vector<std::string> names;
  bool listed = false;
  for (std::string line; std::getline(help, line);) {
    if (listed && line.starts_with("  ") && line[2] != ' ')
      names.push_back(line.substr(2, line.find(' ', 2) - 2));
    listed = listed || line == "Subcommands:" || line == "Compare descriptions:";
  }
  return names;
}

// One option, one meaning: in every command that has it, a word takes the same kind of value and says the
// same.
TEST(Usage, AnOptionMeansOneThing) {
  std::vector<std::vector<std::string>> commands;
  for (const std::string& name : ListCommands({})) {
    commands.push_back({name});
    for (const std::string& next : ListCommands({name})) commands.push_back({name, next});
  }
  ASSERT_GE(commands.size(), 25U);
  const std::map<std::string, std::string> meanings = {
      {"--json",
       R"(\[FILE\.json\].*Write .* to this file; without one, or with -, print them and nothing else)"},
      {"--junit", R"(FILE\.xml.*as a test case of JUnit's XML to this file)"},
      {"--samples", "N=.*Number of random states"},
      {"--out", R"((DIR|FILE)[ .=].*)"},
      {"--ignore", "WORD,.*What the two need not share of joints.*"},
      {"--floating", "The root of a URDF floats"},
      {"--digits", "N.*"},
      {"--tolerance", ".*REL.*"}};
  std::map<std::string, int> seen;
  for (std::vector<std::string> command : commands) {
    command.emplace_back("--help");
    const std::string help = RunDexcheck(command).out;
    std::istringstream lines(help);
    for (std::string line; std::getline(lines, line);)
      EXPECT_LE(line.size(), 80U) << command[0] << ": " << line;
    for (const auto& [word, meaning] : meanings) {
      const size_t at = help.find("\n  " + word);
      if (at == std::string::npos) continue;
      ++seen[word];
      const size_t end = help.find("\n  -", at + 4);
      std::string text =
          help.substr(at + 3 + word.size(), end == std::string::npos ? end : end - at - 3 - word.size());
      text = std::regex_replace(text, std::regex("\\s+"), " ");
      EXPECT_TRUE(std::regex_search(text, std::regex(meaning))) << command[0] << " " << word << text;
    }
  }
  EXPECT_GE(seen["--json"], 10);
  EXPECT_GE(seen["--out"], 9);
  EXPECT_GE(seen["--samples"], 5);
  EXPECT_EQ(seen["--ignore"], 3);
}

// What a terminal shows of 80 columns. Names of files may be longer.
TEST(Usage, TablesFitEightyColumns) {
  const TempFolder folder;
  const std::string panda = testing::kMjcf + "panda.xml";
  const std::string a = (folder.path() / "a").string();
  const std::string b = (folder.path() / "b").string();
  const auto run = [](const std::string& scenario, const std::string& out) {
    return std::vector<std::string>{"run",        scenario, "--set",       "duration=0.02", "--set",
                                    "settle=0.1", "--all",  "--no-report", "--out",         out};
  };
  std::vector<std::vector<std::string>> commands = {
      run("paper", a),
      run("panda-reach", b),
      {"run", "--list"},
      {"consistency", "--samples", "2"},
      {"audit", panda},
      {"engines", panda, "--samples", "2", "--engines", "analytic,mujoco"},
      {"compare", a, b, "--all"},
      {"export", a, "--list"},
      {"export", b, "--list"}};
  for (const char* command : {"consistency", "diagnose"}) {
    std::vector<std::string> words = {command, "--samples", "2"};
    words.insert(words.end(), testing::kPandaFiles.begin(), testing::kPandaFiles.end());
    commands.push_back(words);
  }
  for (const std::vector<std::string>& command : commands) {
    const testing::ProgramResult result = RunDexcheck(command);
    EXPECT_LE(result.exit_code, 1) << command[0] << result.err;
    EXPECT_NE(result.out, "");
    std::istringstream lines(result.out);
    for (std::string line; std::getline(lines, line);) {
      EXPECT_TRUE(line.size() <= 80 || line.find(folder.path().string()) != std::string::npos ||
                  line.find("cp ") != std::string::npos)
          << command[0] << ": " << line;
    }
  }
}

/// The same checks for the two commands that write a file.
class Outputs : public ::testing::TestWithParam<std::vector<std::string>> {
 protected:
  Outputs() {
    WriteText(folder_.path() / "state.json", R"({"q": [0.1, 0.2], "xi": [0.3, 0.4]})");
    WriteText(folder_.path() / "robot.toml", testing::kTwoLinksToml);
    WriteText(folder_.path() / "robot.xml", testing::kTwoLinksMjcf);
  }

  /// Runs the command with its output meant for `file`.
  testing::ProgramResult Run(const std::string& file, testing::ProgramOptions options = {}) {
    std::vector<std::string> arguments = GetParam();
    arguments.push_back(file);
    options.folder = folder_.path();
    return RunDexcheck(arguments, options);
  }

  [[nodiscard]] long CountFiles() const {
    const auto files = std::filesystem::directory_iterator(folder_.path());
    return std::distance(begin(files), end(files));
  }

  TempFolder folder_;
};

TEST_P(Outputs, ReplaceWhatWasThere) {
  WriteText(folder_.path() / "out.json", "before");
  std::filesystem::create_symlink("out.json", folder_.path() / "link.json");
  EXPECT_EQ(Run("link.json").exit_code, 0);
  EXPECT_THAT(ReadText(folder_.path() / "out.json"), ::testing::StartsWith("{\n"));
  EXPECT_TRUE(std::filesystem::is_symlink(folder_.path() / "link.json"));
  EXPECT_EQ(CountFiles(), 5);
}

TEST_P(Outputs, ThatCannotBeWrittenAreNamed) {
  EXPECT_TRUE(IsRefused(Run("no/folder.json"), {"no/folder.json: cannot be written: No such file"}));
  EXPECT_TRUE(IsRefused(Run("."), {".: cannot be written: Is a directory"}));
  EXPECT_EQ(CountFiles(), 3);
}

TEST_P(Outputs, StayWholeOnAFullDisk) {
  WriteText(folder_.path() / "out.json", "before");
  testing::ProgramOptions options;
  options.largest_file = 1000;
  EXPECT_TRUE(IsRefused(Run("out.json", options), {"out.json: cannot be written: File too large"}));
  EXPECT_EQ(ReadText(folder_.path() / "out.json"), "before");
  EXPECT_EQ(CountFiles(), 4);
}

bool IsDevice(const char* path) {
  struct stat status {};
  return ::stat(path, &status) == 0 && S_ISCHR(status.st_mode);
}

// By a link in the temporary folder, so that a program that replaces devices by files would replace the link
// only.
TEST_P(Outputs, DevicesAreWrittenToInPlace) {
  if (!IsDevice("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  std::filesystem::create_symlink("/dev/full", folder_.path() / "full.json");
  EXPECT_TRUE(IsRefused(Run("full.json"), {"full.json: cannot be written: No space left on device"}));
  EXPECT_TRUE(std::filesystem::is_symlink(folder_.path() / "full.json"));
  EXPECT_TRUE(IsDevice("/dev/full"));
  EXPECT_EQ(CountFiles(), 4);

  testing::ProgramOptions options;
  options.out = "/dev/full";
  EXPECT_TRUE(IsRefused(Run("-", options), {"standard output: cannot be written: No space left on device"}));
}

INSTANTIATE_TEST_SUITE_P(Commands, Outputs,
                         ::testing::Values(std::vector<std::string>{"consistency", "--samples", "2",
                                                                    "--robot", "robot.toml", "--mjcf",
                                                                    "robot.xml", "--json"},
                                           std::vector<std::string>{"eval", "--robot", "robot.toml",
                                                                    "--state", "state.json", "--out"}),
                         [](const auto& info) { return info.param.front(); });

}  // namespace
}  // namespace dexcheck::testing::usage_test
