// The command line itself: options that mean one thing, tables that fit a terminal, and outputs that cannot
// be written.

#include <sys/stat.h>

#include <map>
#include <regex>
#include <sstream>

#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::usage_test {
namespace {

/// The words of a command that --help lists under a title.
std::vector<std::string> ListCommands(const Words& command) {
  std::istringstream help(RunDexcheck(command + "--help").out);
  std::vector<std::string> names;
  bool listed = false;
  for (std::string line; std::getline(help, line);) {
    if (listed && line.starts_with("  ") && line[2] != ' ')
      names.push_back(line.substr(2, line.find(' ', 2) - 2));
    if (line == "Examples:") break;
    listed = listed || line == "Subcommands:" || line == "Compare descriptions:";
  }
  return names;
}

// One option, one meaning: in every command that has it, a word takes the same kind of value and says the
// same.
TEST(Usage, AnOptionMeansOneThing) {
  std::vector<Words> commands;
  for (const std::string& name : ListCommands("")) {
    commands.emplace_back(name);
    for (const std::string& next : ListCommands(name)) commands.push_back({name, next});
  }
  ASSERT_GE(commands.size(), 25U);
  const std::map<std::string, std::string> meanings = {
      {"--json",
       R"(\[FILE\.json\].*Write .* to this file; without one, or with -, print them and nothing else)"},
      {"--junit", R"(FILE\.xml.*as a test case of JUnit's XML to this file)"},
      {"--samples", "N=.*Number of random states"},
      {"--out", R"((DIR|FILE)[ .=].*)"},
      {"--page", R"(FILE\.html.*page.*)"},
      {"--ignore", "WORD,.*Constants of joints in which the two may differ.*"},
      {"--floating", "The root of a URDF floats"},
      {"--digits", "N.*"},
      {"--tolerance", ".*REL.*"}};
  std::map<std::string, int> seen;
  for (const Words& command : commands) {
    const std::string help = RunDexcheck(command + "--help").out;
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
  EXPECT_GE(seen["--out"], 7);
  EXPECT_GE(seen["--page"], 6);
  EXPECT_GE(seen["--samples"], 3);
  EXPECT_EQ(seen["--ignore"], 3);
}

// An empty text is what a variable of a shell leaves that has no value: never what was meant.
// Every command shows two lines to type, and has the options that are in them.
TEST(Usage, ExamplesHaveOptionsThatThereAre) {
  std::vector<Words> commands;
  for (const std::string& name : ListCommands("")) {
    for (const std::string& next : ListCommands(name)) commands.push_back({name, next});
    if (name != "study") commands.emplace_back(name);
  }
  for (const Words& command : commands) {
    const std::string help = RunDexcheck(command + "--help").out;
    const size_t at = help.find("\nExamples:\n");
    ASSERT_NE(at, std::string::npos) << command[0];
    const std::string examples = help.substr(at);
    EXPECT_EQ(std::ranges::count(examples, '\n'), 4) << examples;
    const std::regex option("--[a-z-]+");
    for (std::sregex_iterator word(examples.begin(), examples.end(), option), end; word != end; ++word)
      EXPECT_LT(help.find("  " + word->str() + " "), at) << word->str() << examples;
  }
}

TEST(Usage, NoTextIsEmpty) {
  for (const Words& words :
       {Words{"run", "hold", "--controller", ""}, Words{"run", "hold", "--out", ""},
        Words{"run", "hold", "--set", ""}, Words{"run", ""}, Words{"run", "--replay", ""},
        Words{"consistency", "--model", ""}, Words{"consistency", kPandaToml, ""},
        Words{"judge", kPandaToml, "recording.csv", "--columns", ""}, Words{"judge", kPandaToml, ""},
        Words{"compare", "a", ""}, Words{"export", "a", "--csv", ""}, Words{"report", "a", "--page", ""},
        Words{"study", "run", "joint_gains", "--db", ""}, Words{"import", kPandaXml, "--out="},
        Words{"init", kPandaXml, "--out", ""}, Words{"eval", "--q", ""}}) {
    EXPECT_TRUE(IsRefused(RunDexcheck(words), {"must not be empty"}) ||
                IsRefused(RunDexcheck(words), {"--help"}))
        << words[0] << " " << words[words.size() - 2];
  }
}

TEST(Usage, TwoRobotsAreComparedWithoutTheWordForIt) {
  const auto compare = [](const Words& words) {
    Json results =
        Json::parse(RunDexcheck(words + Words{kPandaToml, kPandaXml, "--samples", "2", "--json"}).out);
    results.erase("seconds");
    return results;
  };
  EXPECT_EQ(compare(Words{}), compare("consistency"));
  EXPECT_TRUE(IsRefused(RunDexcheck(Words{kPandaToml}),
                        {"takes two files, got " + kPandaToml, "init, audit, judge take one"}));
  const TempFolder folder;
  std::filesystem::copy(kPandaXml, folder.path() / "panda.mjcf");
  WriteText(folder.path() / "rows.csv", "t,nothing\n0,1\n");
  const auto run = [&](const Words& words) { return RunDexcheck(words, {.folder = folder.path()}); };
  EXPECT_EQ(run({"panda.mjcf", "panda.mjcf", "--samples", "2"}).exit_code, 0);
  EXPECT_TRUE(IsRefused(run({kPandaToml, "rows.csv"}), {"rows.csv", "joint"})) << "is judged";
}

TEST(Usage, TheVersionIsThreeNumbers) {
  EXPECT_THAT(RunDexcheck("--version").out, ::testing::MatchesRegex("[0-9]+\\.[0-9]+\\.[0-9]+\n"));
  const std::string both = RunDexcheck("version").out;
  EXPECT_THAT(both, HasSubstr("dexcheck " + RunDexcheck("--version").out));
  EXPECT_THAT(both, HasSubstr("MuJoCo 2.2.2"));
}

// Tables fit a terminal of 80 columns. Names of files may be longer.
using Tables = CommandTest;

TEST_F(Tables, FitEightyColumns) {
  for (const std::string command :
       {"run paper --set duration=0.02 --set settle=0.1 --all --no-report --out a",
        "run panda-reach --set duration=0.02 --set settle=0.1 --all --no-report --out b", "run --list",
        "consistency --samples 2", "compare a b --all", "export a --list", "export b --list",
        "audit PANDA.xml", "engines PANDA.xml --samples 2 --engines analytic,mujoco",
        "consistency PANDA.toml PANDA.xml --samples 2", "diagnose PANDA.toml PANDA.xml"}) {
    Words words(command);
    for (std::string& word : words) {
      if (word == "PANDA.toml") word = kPandaToml;
      if (word == "PANDA.xml") word = kPandaXml;
    }
    const ProgramResult result = Run(words);
    EXPECT_LE(result.exit_code, 1) << command << result.err;
    EXPECT_NE(result.out, "");
    std::istringstream lines(result.out);
    for (std::string line; std::getline(lines, line);) {
      // Names of files, and times, which have more digits on a machine that is busy.
      const bool varies =
          line.find("cp ") != std::string::npos || line.find(" real time") != std::string::npos;
      EXPECT_TRUE(line.size() <= 80 || varies) << command << ": " << line;
    }
  }
}

// Folders of another encoding, Latin-1 here, are no reason for JSON that nobody can read.
TEST_F(Tables, JsonIsValidWhateverBytesANameHas) {
  const std::string folder = "arm\xe9";
  std::filesystem::create_directory(Path(folder));
  for (const std::string file : {"two.toml", "two.xml"}) Write(folder + "/" + file, ReadFixture(file));
  const std::string toml = folder + "/two.toml", xml = folder + "/two.xml";
  for (const Words& words : {Words{"audit", toml}, Words{"consistency", toml, xml, "--samples", "2"},
                             Words{"diagnose", toml, xml}})
    EXPECT_EQ(RunJson(0, words).at("robot"), "arm\uFFFD/two.toml") << words[0];
}

/// The same checks for the two commands that write a file.
class Outputs : public CommandTest, public ::testing::WithParamInterface<const char*> {
 protected:
  Outputs() {
    Copy("two.toml");
    Copy("two.xml");
    Write("state.json", R"({"q": [0.1, 0.2], "xi": [0.3, 0.4]})");
  }

  /// Runs the command with its output into `file`.
  [[nodiscard]] ProgramResult RunInto(const std::string& file, const ProgramOptions& options = {}) const {
    return Run(Words(GetParam()) + Words{file}, options);
  }
};

TEST_P(Outputs, ReplaceWhatWasThere) {
  Write("out.json", "before");
  std::filesystem::create_symlink("out.json", Path("link.json"));
  EXPECT_EQ(RunInto("link.json").exit_code, 0);
  EXPECT_TRUE(ReadJson("out.json").is_object());
  EXPECT_TRUE(std::filesystem::is_symlink(Path("link.json")));
  EXPECT_EQ(CountFiles(), 5);
}

TEST_P(Outputs, StayWholeOnAFullDisk) {
  Write("out.json", "before");
  EXPECT_TRUE(IsRefused(RunInto("out.json", {.largest_file = 1000}), {"out.json: ", "File too large"}));
  EXPECT_EQ(Read("out.json"), "before");
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
  std::filesystem::create_symlink("/dev/full", Path("full.json"));
  EXPECT_TRUE(IsRefused(RunInto("full.json"), {"full.json: ", "No space left on device"}));
  EXPECT_TRUE(std::filesystem::is_symlink(Path("full.json")));
  EXPECT_TRUE(IsDevice("/dev/full"));
  EXPECT_EQ(CountFiles(), 4);
  EXPECT_TRUE(
      IsRefused(RunInto("-", {.out = "/dev/full"}), {"standard output: ", "No space left on device"}));
}

INSTANTIATE_TEST_SUITE_P(Commands, Outputs,
                         ::testing::Values("consistency two.toml two.xml --samples 2 --json",
                                           "eval two.toml --state state.json --out"),
                         [](const auto& info) { return info.index == 0 ? "consistency" : "eval"; });

}  // namespace
}  // namespace dexcheck::testing::usage_test
