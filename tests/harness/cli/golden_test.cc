// The wording of each command: golden/NAME.txt holds what it prints, in one place. Everywhere else tests
// assert facts (exit codes, JSON, the file, key and value that an error names). To write what is printed now:
//
//   DEXCHECK_RENEW_GOLDEN=1 build/release/tests/cli_test --gtest_filter='*Golden*'
//
// A line that begins with "$ " is a command of a shell in a folder with the files of files/. Numbers that are
// not whole stand as #; line breaks and blanks are not compared.

#include <cstdlib>
#include <regex>
#include <sstream>

#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::golden_test {
namespace {

const std::string kFolder = SourcePath("/tests/harness/cli/golden/");

std::vector<std::string> SplitWords(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) {
    if (word.find_first_not_of('-') != std::string::npos)
      words.push_back(word);  // rules are as wide as tables
  }
  return words;
}

/// The text with # for what varies with the machine: numbers that rounding decides, and times of the clock.
std::string HideNumbers(std::string text) {
  static const std::regex numbers(
      R"([-+]?\b\d+(\.\d+(e[-+]?\d+)?|e[-+]?\d+)|\b\d+(?=(\s+[\d#]\S*)?\s+(s|min|h|us|ms|times|x real)\b))");
  static const std::regex parts(R"(\b(plant|controller|checks|log) \d+)");  // us a step
  static const std::regex ratios(R"((\bu?s\s+x) \d+)");                     // of times
  text = std::regex_replace(std::regex_replace(text, numbers, "#"), parts, "$1 #");
  return std::regex_replace(text, ratios, "$1 #");
}

class Golden : public CommandTest, public ::testing::WithParamInterface<const char*> {
 protected:
  Golden() {
    for (const auto& file : std::filesystem::directory_iterator(SourcePath("/tests/harness/cli/files")))
      Copy(file.path().filename());
  }

  /// A command and what it prints: standard output, standard error, and the exit code unless that is 0.
  [[nodiscard]] std::string Transcribe(const std::string& command) const {
    const std::string program = std::filesystem::path(ProgramPath()).parent_path();
    const ProgramResult result =
        RunProgram({"/bin/sh", "-c", "PATH='" + program + "':$PATH; " + command}, {.folder = folder_.path()});
    std::string text = "$ " + command + "\n" + HideNumbers(result.out + result.err);
    if (result.exit_code != 0) text += "exit code " + std::to_string(result.exit_code) + "\n";
    return text + "\n";
  }
};

TEST_P(Golden, WordsAreThoseOfTheFile) {
  const std::string path = kFolder + GetParam() + ".txt";
  const std::string golden = ReadText(path);
  std::string printed;
  std::istringstream lines(golden);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("$ ")) printed += Transcribe(line.substr(2));
  }
  ASSERT_NE(printed, "") << path << " has no command";
  if (std::getenv("DEXCHECK_RENEW_GOLDEN") != nullptr) {
    WriteText(path, printed);
    return;
  }
  const std::vector<std::string> expected = SplitWords(golden);
  const std::vector<std::string> actual = SplitWords(printed);
  const auto [at, other] = std::mismatch(expected.begin(), expected.end(), actual.begin(), actual.end());
  const auto quote = [](auto from, auto end) {
    std::string text;
    for (int i = 0; i < 12 && from != end; ++i) text += *from++ + " ";
    return text;
  };
  EXPECT_TRUE(at == expected.end() && other == actual.end())
      << path << ": \"" << quote(at, expected.end()) << "\" is now \"" << quote(other, actual.end())
      << "\"; where that is meant, renew the file (DEXCHECK_RENEW_GOLDEN=1)";
}

constexpr const char* kFiles[] = {"audit",  "compare", "consistency", "dexcheck", "diagnose",
                                  "eval",   "export",  "import",      "mutate",   "render",
                                  "report", "run",     "study"};
INSTANTIATE_TEST_SUITE_P(All, Golden, ::testing::ValuesIn(kFiles),
                         [](const auto& info) { return std::string(info.param); });

TEST(GoldenFiles, AreAllCompared) {
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(kFolder), {}), std::ssize(kFiles));
}

}  // namespace
}  // namespace dexcheck::testing::golden_test
