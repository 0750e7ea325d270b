#pragma once

// The command line's words: commands, options, flags, as CLI11 reads them.

#include <CLI/CLI.hpp>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

namespace dexcheck::cli {

/// 0 all good, 1 the check found a disagreement, 2 usage or input error, 3 the run could not be completed.
enum ExitCode { kSuccess = 0, kDisagreement = 1, kInputError = 2, kFailure = 3 };

/// A failure always has its line on standard error, whatever is printed. @returns kFailure.
ExitCode ReportFailure(const std::string& why);

/// The words cannot be understood; what() says why.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A check says what is wrong with a value as typed; empty when nothing is.
using ValueCheck = std::function<std::string(const std::string& value)>;

/// Accepts decimal whole numbers from `least` to `most`.
ValueCheck WholeNumber(std::uint64_t least, std::uint64_t most);

/// Accepts finite numbers above zero. @param demand what is said of others.
ValueCheck PositiveNumber(const std::string& demand = "must be a positive number");

/// Accepts numbers from `least` to `most`.
ValueCheck NumberFrom(double least, double most);

/// Accepts numbers above 0 and below 1.
ValueCheck Fraction();

/// Adds an option to a command. @param name with its dashes and, as the help shows it, the name of its value,
/// "--out DIR"; of a positional argument its name alone, or with an option that means the same, "A,--robot".
/// @param value lives as long as the command; what it holds is the default. It must not be empty.
template <typename Value>
CLI::Option* AddOption(CLI::App* command, const std::string& name, Value* value, const std::string& help) {
  const size_t blank = name.find(' ');
  CLI::Option* const option = command->add_option(name.substr(0, blank), *value, help);
  option->check([](const std::string& text) { return std::string(text.empty() ? "must not be empty" : ""); });
  if (blank != std::string::npos) option->type_name(name.substr(blank + 1));
  return option;
}

/// Adds a command, under the heading that is the program's group. @param examples two lines to type, which
/// its help shows.
CLI::App* AddCommand(CLI::App* app, const std::string& name, const std::string& help,
                     const std::array<const char*, 2>& examples);

/// Sets what is done when the command is given. @param action returns the program's exit code.
template <typename Action>
void SetAction(CLI::App* command, const Action& action) {
  command->callback([action] { throw CLI::RuntimeError(action()); });
}

/// Adds a command whose options fill a request: when it is given, the function Run of the request's own
/// namespace is called with it. @returns both.
template <typename Request>
std::pair<CLI::App*, Request*> AddRequest(CLI::App* app, const std::string& name, const std::string& help,
                                          const std::array<const char*, 2>& examples) {
  const auto request = std::make_shared<Request>();
  CLI::App* const command = AddCommand(app, name, help, examples);
  SetAction(command, [request] { return Run(*request); });
  return {command, request.get()};
}

/// Reads the words and does what the command's action does. Two files of robots instead of a command are
/// compared, as by "consistency"; a robot and a recording are judged, as by "judge". @returns the program's
/// exit code; --help and --version print and are a success. @throws UsageError, which for an unknown word
/// names the nearest known one; what the action throws.
int RunCommandLine(CLI::App* app, int argc, char** argv);

/// The lines of the help fit the terminal, descriptions below one another.
std::shared_ptr<CLI::FormatterBase> MakeHelpFormatter();

}  // namespace dexcheck::cli
