#pragma once

// The commands of the program dexcheck.

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/descriptions/urdf_reader.h"

namespace dexcheck::cli {

// The command line's words: commands, options, flags, as CLI11 reads them.

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

/// The files that a command's results go to, and whether it prints less.
struct Outputs {
  std::string json_file, junit_file, page_file;  ///< Empty for none.
  bool quiet = false;
};

/// The two files that describe one robot.
struct RobotFiles {
  std::filesystem::path robot;
  std::filesystem::path mjcf;

  /// Takes the shipped pair where no file was given.
  void TakeShipped();
};

/// Adds the positional arguments A and B, which --robot and --mjcf name, too. @returns both.
std::array<CLI::Option*, 2> AddFileOptions(CLI::App* command, const std::string& help_a,
                                           const std::string& help_b, RobotFiles* files);

/// A controller of the user's own in the place of a scenario's.
struct OwnController {
  std::string run;          ///< As the scenario's key controller.run, in the current folder; empty for none.
  double time_limit = 0.0;  ///< s; 0 for the scenario's.
  /// Assignments as ParseScenario takes them. @returns none without a controller.
  [[nodiscard]] std::vector<std::string> List() const;
};

/// Adds --controller and --controller-time-limit. @returns the first.
CLI::Option* AddControllerOptions(CLI::App* command, OwnController* controller);

/// Changes of a scenario.
struct Overrides {
  std::vector<std::string> set;    ///< "KEY=VALUE"
  std::vector<std::string> unset;  ///< "KEY"
  OwnController controller;
  [[nodiscard]] bool empty() const { return set.empty() && unset.empty() && controller.run.empty(); }
  /// Assignments as ParseScenario takes them: those that remove a key come first.
  [[nodiscard]] std::vector<std::string> List() const;
};

/// Adds --set and --unset, and AddControllerOptions. @returns the three, without the time limit.
std::array<CLI::Option*, 3> AddOverrideOptions(CLI::App* command, Overrides* overrides);

/// Adds --jobs. @param what is made: "Trials". @param jobs 0 for one on each processor, as CountJobs reads
/// it.
CLI::Option* AddJobsOption(CLI::App* command, const std::string& what, std::uint64_t* jobs);
int CountJobs(std::uint64_t jobs);

/// Adds --seed. @param help what is drawn by it.
CLI::Option* AddSeedOption(
    CLI::App* command, std::uint64_t* seed,
    const std::string& help = "Seed of random changes to posture and grasp; 0 for none");

/// Adds --samples, of at most `most`, and --seed: the random states at which two descriptions are compared.
template <typename Count>
std::array<CLI::Option*, 2> AddSampleOptions(CLI::App* command, std::uint64_t most, Count* samples,
                                             std::uint64_t* seed,
                                             const std::string& help = "Number of random states") {
  return {
      AddOption(command, "--samples N", samples, help)->check(WholeNumber(1, most))->capture_default_str(),
      AddSeedOption(command, seed, "Seed of the random states")->capture_default_str()};
}

/// Adds --json [FILE]: JSON to this file; without a file, or with "-", to standard output and nothing else.
/// @param what the file gets: "the findings".
CLI::Option* AddJsonOption(CLI::App* command, const std::string& what, std::string* file);

/// Adds --junit.
CLI::Option* AddJUnitOption(CLI::App* command, std::string* file);

/// Adds --ignore: constants of joints that two descriptions need not share.
CLI::Option* AddIgnoreOption(CLI::App* command, std::vector<std::string>* ignore);

/// Adds --package and --floating.
void AddUrdfOptions(CLI::App* command, UrdfOptions* options);

/// Each adds its command to `app`.
void AddAuditCommand(CLI::App* app);
void AddJudgeCommand(CLI::App* app);
void AddConsistencyCommand(CLI::App* app);
void AddDiagnoseCommand(CLI::App* app);
void AddMutateCommand(CLI::App* app);
void AddEvalCommand(CLI::App* app);
void AddImportCommand(CLI::App* app);
void AddInitCommand(CLI::App* app);
/// @param command_line as typed, to be kept in the log.
void AddRunCommand(CLI::App* app, const std::string& command_line);
void AddBudgetCommand(CLI::App* app);
void AddCompareCommand(CLI::App* app);
void AddExciteCommand(CLI::App* app);
void AddExportCommand(CLI::App* app);
void AddEngineComparisonCommand(CLI::App* app);
void AddRenderCommand(CLI::App* app);
void AddReportCommand(CLI::App* app);
void AddHelpCommands(CLI::App* app);
void AddStudyCommand(CLI::App* app);

// Options that the commands which compare descriptions of a robot have in common.

/// --digits and --tolerance: how published numbers, which are rounded when printed, are judged.
struct ToleranceOptions {
  int digits = 0;                   ///< 0: not given.
  std::optional<double> tolerance;  ///< Relative, wider than rounding.

  /// The relative tolerance; none: by rounding.
  [[nodiscard]] std::optional<double> Find() const {
    return digits > 0 ? std::pow(10.0, -digits) : tolerance;
  }
};

/// Adds the two options, of which one may be given. @returns them.
inline std::array<CLI::Option*, 2> AddToleranceOptions(CLI::App* command, ToleranceOptions* options) {
  constexpr int kMostDigits = 15;
  CLI::Option* const digits = AddOption(command, "--digits N", &options->digits,
                                        "Agreement to this many digits of a term's scale is enough")
                                  ->check(WholeNumber(1, kMostDigits));
  CLI::Option* const tolerance =
      AddOption(command, "--tolerance REL", &options->tolerance, "The same as a relative tolerance")
          ->check(Fraction())
          ->excludes(digits);
  return {digits, tolerance};
}

/// Two recordings against each other, by a model of the robot.
struct RecordingPair : Outputs {
  std::filesystem::path model, first, second, columns;
};

/// Prints how far they are apart and what differs. @return the exit code: 1 where something differs.
int CompareTwoRecordings(const RecordingPair& pair);

/// Makes the video of a run as `dexcheck run --video` does: with contact forces. @return false when the user
/// stopped it; nothing is then written. @throws InputError when the file cannot be written.
bool WriteRunVideo(const std::filesystem::path& run_folder, const std::string& out, bool quiet);

}  // namespace dexcheck::cli
