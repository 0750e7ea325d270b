#pragma once

// The command line's words: commands, options, flags. CLI11 reads them; it consists of headers that cost each
// source which includes them ten seconds, so that only command_line.cc does.

#include <array>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

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

/// An option, a flag or a positional argument.
class Option {
 public:
  /// How the help names its value: "FILE.toml".
  Option& TypeName(const std::string& name);
  Option& Required();
  Option& Excludes(const Option& other);
  Option& Needs(const Option& other);
  Option& Check(const ValueCheck& check);
  Option& OneOf(std::initializer_list<const char*> values);
  /// Takes one value each time that it is given, and may be given again.
  Option& Repeatable();
  /// Values may be separated by this character.
  Option& Delimiter(char delimiter);
  /// The help prints the value that the variable has now.
  Option& ShowDefault();

 private:
  friend class Command;
  explicit Option(CLI::Option* option) : option_(option) {}
  CLI::Option* option_;
};

/// A command with its options, or the program with its commands. A handle: copies are the same command.
class Command {
 public:
  /// @param name of an option with its dashes and, as the help shows it, the name of its value, "--out DIR";
  /// of a positional argument its name alone, or with an option that means the same, "A,--robot". @param
  /// value lives as long as the command; what it holds is the default. Its type is one of those at the end of
  /// command_line.cc: texts, paths, numbers and lists of them.
  template <typename Value>
  Option AddOption(const std::string& name, Value* value, const std::string& help);
  Option AddFlag(const std::string& name, bool* value, const std::string& help);
  /// A word that says what the command does already.
  Option AddFlag(const std::string& name, const std::string& help);

  /// This command again, whose next commands stand under this heading in the help.
  [[nodiscard]] Command Under(const std::string& heading) const;
  /// @param examples two lines to type, which its help shows.
  Command AddCommand(const std::string& name, const std::string& help,
                     const std::array<const char*, 2>& examples);
  /// Adds a command whose options fill a request: when it is given, the function Run of the request's own
  /// namespace is called with it. @returns both.
  template <typename Request>
  std::pair<Command, Request*> AddRequest(const std::string& name, const std::string& help,
                                          const std::array<const char*, 2>& examples) {
    const auto request = std::make_shared<Request>();
    Command command = AddCommand(name, help, examples);
    command.SetAction([request] { return Run(*request); });
    return {command, request.get()};
  }
  /// Whether the command line has this option of the command, "--out".
  [[nodiscard]] bool is_given(const std::string& option) const;
  /// One of its commands must be given.
  void RequireCommand();
  /// Sets the function that runs when the command is given; its exit code is the program's. @throws
  /// UsageError.
  void SetAction(const std::function<int()>& action);

 private:
  friend class CommandLine;
  Command(CLI::App* app, int* exit_code) : app_(app), exit_code_(exit_code) {}
  CLI::App* app_;
  int* exit_code_;
  std::string heading_;
};

/// The words of an option or a positional argument.
struct OptionHelp {
  std::vector<std::string> names;  ///< "--out"; of a positional argument its one name.
  bool is_positional = false;
};

/// And of a command.
struct CommandHelp {
  std::string name;  ///< "study run"; empty for the program itself.
  std::vector<OptionHelp> options;
  std::vector<std::string> commands;  ///< Next words.
};

/// The program's whole command line.
class CommandLine {
 public:
  CommandLine(const std::string& program, const std::string& help, const std::string& version);
  ~CommandLine();

  /// The words by command: the program first, then all commands in order.
  [[nodiscard]] std::vector<CommandHelp> Describe() const;
  [[nodiscard]] Command root() { return {app_.get(), &exit_code_}; }
  /// Reads the words and runs the command's action. Two files of robots instead of a command are compared, as
  /// by "consistency"; a robot and a recording are judged, as by "judge". @returns the program's exit code;
  /// --help and --version print and are a success. @throws UsageError, which for an unknown word names the
  /// nearest known one; what the action throws.
  int Run(int argc, char** argv);

 private:
  [[nodiscard]] std::string Explain(const std::string& what) const;
  /// " (see dexcheck study run --help)", of the command that was given.
  [[nodiscard]] std::string NameHelp() const;
  std::unique_ptr<CLI::App> app_;
  int exit_code_ = kSuccess;
};

}  // namespace dexcheck::cli
