#pragma once

// The commands of the program dexcheck. Each adds itself to the command line and returns the exit code when
// run.

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>

namespace dexcheck::cli {

/// 0 all good, 1 the check found a disagreement, 2 usage or input error, 3 the run could not be completed.
enum ExitCode { kSuccess = 0, kDisagreement = 1, kInputError = 2, kFailure = 3 };

/// The two files that describe one robot; the shipped pair by default.
struct RobotFiles {
  std::filesystem::path robot;
  std::filesystem::path mjcf;
};

/// Adds --robot and --mjcf, both or neither.
void AddRobotOptions(CLI::App* command, RobotFiles* files);

/// Accepts decimal whole numbers from `least` to `most`.
CLI::Validator WholeNumber(std::uint64_t least, std::uint64_t most);

/// Each adds its command to `app`; the callback stores what running it returns in `exit_code`.
void AddConsistencyCommand(CLI::App* app, int* exit_code);
void AddDiagnoseCommand(CLI::App* app, int* exit_code);
void AddMutateCommand(CLI::App* app, int* exit_code);
void AddEvalCommand(CLI::App* app, int* exit_code);
void AddPlanCommand(CLI::App* app, int* exit_code);
/// @param command_line as typed, to be kept in the log.
void AddRunCommand(CLI::App* app, const std::string& command_line, int* exit_code);
void AddExportCommand(CLI::App* app, int* exit_code);
void AddRenderCommand(CLI::App* app, int* exit_code);
void AddReportCommand(CLI::App* app, int* exit_code);
void AddStudyCommand(CLI::App* app, int* exit_code);

}  // namespace dexcheck::cli
