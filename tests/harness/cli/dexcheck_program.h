#pragma once

// The program under test, as its users run it, in a folder of its own; and robots small enough to be read at
// a glance (files/).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/common/matchers.h"
#include "tests/common/paths.h"
#include "tests/common/run_program.h"

namespace dexcheck::testing {

using Json = nlohmann::json;

/// The words of a command: a list, or a text as in a shell, where '...' holds a word with blanks together.
class Words : public std::vector<std::string> {
 public:
  Words(std::initializer_list<std::string> words) : vector(words) {}
  Words(std::vector<std::string> words) : vector(std::move(words)) {}
  Words(const char* text) : Words(std::string(text)) {}
  Words(const std::string& text) {
    bool quoted = false;
    bool begun = false;
    for (const char c : text) {
      if (c == '\'') {
        quoted = !quoted;
      } else if (c == ' ' && !quoted) {
        begun = false;
        continue;
      }
      if (!std::exchange(begun, true)) emplace_back();
      if (c != '\'') back() += c;
    }
  }
  friend Words operator+(Words a, const Words& b) { return a.insert(a.end(), b.begin(), b.end()), a; }
};

/// Command that runs dexcheck with these arguments.
inline std::vector<std::string> DexcheckCommand(const Words& arguments) {
  return Words{ProgramPath()} + arguments;
}

inline ProgramResult RunDexcheck(const Words& arguments, const ProgramOptions& options = {}) {
  return RunProgram(DexcheckCommand(arguments), options);
}

/// Success when the program refused its input: exit code 2, nothing on standard output, and one line of
/// readable length on standard error that contains all of `parts`.
inline ::testing::AssertionResult IsRefused(const ProgramResult& result,
                                            const std::vector<std::string>& parts) {
  constexpr size_t kReadable = 700;
  const auto fail = [&](const std::string& problem) {
    return ::testing::AssertionFailure() << problem << "; exit code " << result.exit_code << ", out \""
                                         << result.out << "\", err \"" << result.err << "\"";
  };
  if (result.exit_code != 2) return fail("exit code must be 2");
  if (!result.out.empty()) return fail("standard output must be empty");
  if (std::ranges::count(result.err, '\n') != 1 || result.err.back() != '\n' ||
      !result.err.starts_with("dexcheck: ")) {
    return fail("standard error must be one line of the program");
  }
  if (result.err.size() > kReadable) return fail("the line is too long to read");
  for (const std::string& part : parts) {
    if (result.err.find(part) == std::string::npos) return fail("the line lacks \"" + part + "\"");
  }
  return ::testing::AssertionSuccess();
}

/// Success when the JSON of a comparison lists a difference of this check at this place, with these values
/// where they are given.
inline ::testing::AssertionResult HasFinding(const Json& results, const std::string& check,
                                             const std::string& where, const Json& model = nullptr,
                                             const Json& engine = nullptr) {
  for (const Json& finding : results.at("findings")) {
    if (finding.at("check") == check && finding.at("where") == where &&
        (model.is_null() || finding.at("model") == model) &&
        (engine.is_null() || finding.at("engine") == engine))
      return ::testing::AssertionSuccess();
  }
  return ::testing::AssertionFailure()
         << check << " at " << where << " is not among " << results.at("findings");
}

inline std::string FirstLine(const std::string& text) { return text.substr(0, text.find('\n')); }

/// Shipped files.
inline const std::string kParameters = SourcePath("/controller/parameters/");
inline const std::string kMjcf = SourcePath("/mjcf/");
inline const std::string kPandaToml = kParameters + "panda.toml";
inline const std::string kPandaXml = kMjcf + "panda.xml";

/// A file of tests/harness/cli/files: two.toml and two.xml, a fixed base with two hinges; pair.urdf and
/// pair.xml, two hinges and full tensors; arm.xml and own.toml, an arm with a slide and a scenario for it.
inline std::string ReadFixture(const std::string& name) {
  return ReadText(SourcePath("/tests/harness/cli/files/" + name));
}

/// Tests that run dexcheck in a folder of their own; names of files are meant there.
class CommandTest : public ::testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path Path(const std::string& name) const { return folder_.path() / name; }
  [[nodiscard]] std::string Read(const std::string& name) const { return ReadText(Path(name)); }
  [[nodiscard]] Json ReadJson(const std::string& name) const { return Json::parse(Read(name)); }
  [[nodiscard]] bool Has(const std::string& name) const { return std::filesystem::exists(Path(name)); }
  [[nodiscard]] long CountFiles(const std::string& name = ".") const {
    return std::distance(std::filesystem::directory_iterator(Path(name)), {});
  }
  void Write(const std::string& name, const std::string& text) const { WriteText(Path(name), text); }
  /// Writes a text with one place changed.
  void WriteChanged(const std::string& name, const std::string& text, const std::string& from,
                    const std::string& to) const {
    Write(name, ReplaceOnce(text, from, to));
  }
  /// Copies a fixture under its own name.
  void Copy(const std::string& fixture) const { Write(fixture, ReadFixture(fixture)); }

  [[nodiscard]] ProgramResult Run(const Words& arguments, ProgramOptions options = {}) const {
    options.folder = folder_.path();
    return RunDexcheck(arguments, options);
  }
  /// Runs the command, which must end with this exit code.
  ProgramResult Expect(int exit_code, const Words& arguments, const ProgramOptions& options = {}) const {
    const ProgramResult result = Run(arguments, options);
    EXPECT_EQ(result.exit_code, exit_code) << arguments[0] << ": " << result.out << result.err;
    return result;
  }
  /// Returns the output of the command with --json.
  [[nodiscard]] Json RunJson(int exit_code, const Words& arguments) const {
    return Json::parse(Expect(exit_code, arguments + Words{"--json", "-"}).out);
  }
  /// The summary of the motion, shortened, of a folder that `init` made.
  [[nodiscard]] Json RunMotion(int exit_code, const std::string& folder) const {
    return RunJson(exit_code, {"run", folder + "/motion.toml", "--no-log", "--set", "settle=0.1"});
  }
  /// The results of a comparison, which must end so.
  Json Compare(int exit_code, const std::string& a, const std::string& b,
               const Words& more = "--seed 1") const {
    return RunJson(exit_code, Words{"consistency", a, b, "--samples", "100"} + more);
  }
  /// Success when the command is refused in one line with these parts.
  [[nodiscard]] ::testing::AssertionResult Refused(const Words& arguments,
                                                   const std::vector<std::string>& parts) const {
    return IsRefused(Run(arguments), parts);
  }

  TempFolder folder_;
};

}  // namespace dexcheck::testing
