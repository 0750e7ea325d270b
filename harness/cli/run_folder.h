#pragma once

// Folders and files of runs: which scenario is named, where results go, what a recorded run was.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "harness/base/files.h"
#include "harness/cli/report.h"
#include "harness/log/log_content.h"
#include "harness/log/log_reader.h"
#include "harness/run/run_recorder.h"
#include "harness/run/runner.h"
#include "harness/scenario/scenario.h"

namespace dexcheck::cli {

/// A scenario with the two descriptions that it runs.
struct ScenarioFiles {
  Scenario scenario;
  std::filesystem::path robot;
  std::filesystem::path mjcf;
};

/// A shipped scenario by its file's name without .toml, or a TOML file; no other is read. @throws InputError.
ScenarioFiles FindScenario(const std::string& name_or_file, const std::vector<std::string>& overrides,
                           std::uint64_t seed);

/// @throws InputError when a folder has something in it.
void RequireFree(const std::filesystem::path& folder);

/// Makes a new folder for the results of one run.
/// @param path empty for runs/NAME, or runs/NAME-2 and so on when that is taken. @returns the path.
/// @throws InputError when the folder cannot be made, or has something in it.
std::filesystem::path MakeRunFolder(std::filesystem::path path, const std::string& name = "");

/// Makes a run, or its first `rows` steps, with a progress bar, until the user interrupts it.
/// @param recorder gets the steps; null for none. @returns how many those are.
long RunWithProgress(const std::string& label, long rows, bool quiet, Runner* runner, RunRecorder* recorder);

/// The first number in which two logs differ; no signal when they do not.
struct ReplayDifference {
  bool within_rounding = true;  ///< All numbers agree as those of different machines do.
  std::string signal;
  double time = 0.0;
  double recorded = 0.0;
  double now = 0.0;
  long rows = 0;
  size_t signals = 0;             ///< Compared.
  std::vector<OldName> replaced;  ///< Of the log; not compared.
};

/// A line on standard error when the log does not hold a whole run.
void WarnOfCut(const std::filesystem::path& run_folder, const LogReader& log);

/// A run as its log keeps it, unpacked.
class RecordedRun {
 public:
  /// @param controller in the place of the one that the log names; "PATH=VALUE" each, as NameController has
  /// them.
  /// @throws InputError when the folder holds no log that can be repeated, and when the log names a
  /// controller and none is given: nothing that a log names is started.
  RecordedRun(const std::filesystem::path& folder, const std::vector<std::string>& controller);
  [[nodiscard]] const ScenarioFiles& files() const { return files_; }
  [[nodiscard]] long rows() const { return log_.rows(); }
  [[nodiscard]] bool was_checked() const;
  /// The machine that the bits depended on, as DescribeMachine says; empty when the log does not have it.
  [[nodiscard]] std::string machine() const { return log_.FindText("machine"); }
  [[nodiscard]] ReplayDifference Compare(const std::filesystem::path& other_log) const;
  [[nodiscard]] const LogReader& log() const { return log_; }

 private:
  LogReader log_;
  TemporaryFolder unpacked_;
  ScenarioFiles files_;
};

/// Path of a file that comes with the program, such as "mjcf/scene.xml": in ../share/dexcheck beside the
/// executable when it is there (an installed program, wherever its tree was moved), otherwise in the folder
/// that the program was built from. @throws InputError when it is in neither.
std::filesystem::path FindShippedFile(const std::filesystem::path& name);

/// A kind of TOML files of which some are shipped, in one folder, and are named without .toml.
struct ShippedKind {
  const char* name;    ///< "scenario".
  const char* folder;  ///< As FindShippedFile takes it.
  const char* listed;  ///< What a message points to for their names; the names themselves when empty.

  /// In alphabetic order. None is read.
  [[nodiscard]] std::vector<std::string> ListNames() const;
  /// A shipped one by its name, or the file that is named. @throws InputError with the nearest name.
  [[nodiscard]] std::filesystem::path Find(const std::string& name_or_file) const;
};
inline constexpr ShippedKind kScenarios = {"scenario", "harness/shipped/scenarios", "dexcheck run --list"};
inline constexpr ShippedKind kStudies = {"study", "harness/shipped/studies", ""};

/// @throws InputError that names the kind of a TOML file when it is another one: "FILE is a study; `dexcheck
/// study` takes it". A file that cannot be read, or is of no known kind, passes: whoever reads it says what
/// is wrong.
/// @param wanted "scenario", "study" or "parameter file of a robot"; another word where none of them will do.
void RequireKind(const std::filesystem::path& file, std::string_view wanted);

/// Whether this names a file, and nothing that is shipped.
bool IsTomlFile(const std::string& name);

/// Copies a shipped scenario with its robot into a folder of its own. @param out empty: named after it.
/// @returns the exit code. @throws InputError when there is none of that name, or files cannot be written.
int CopyScenario(const std::string& name, const std::string& out);

/// Returns a run's verdict, and below it tracking, checks, speed, and where the files are.
/// @param summary of the run. @param folder empty when nothing was written. @param all
/// whether each check has a line, and not each category and what fails of it.
Report MakeRunReport(const Setup& setup, const ClosedLoop& loop, const RunResult& result, const Json& summary,
                     const std::string& folder, bool all);

}  // namespace dexcheck::cli
