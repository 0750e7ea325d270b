#pragma once

// The commands of the program dexcheck.

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/cli/command_line.h"
#include "harness/descriptions/urdf_reader.h"

namespace dexcheck::cli {

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
