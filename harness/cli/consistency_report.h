#pragma once

// The request of `consistency`, and the report of its results.

#include <optional>
#include <string>
#include <vector>

#include "harness/cli/commands.h"
#include "harness/cli/report.h"
#include "harness/comparison/file_comparison.h"

namespace dexcheck::cli {

/// The two sides of a comparison, and the number of states.
struct ConsistencyRequest : Outputs {
  RobotFiles files;
  UrdfOptions urdf;
  ToleranceOptions judging;
  ResultsSource source;  ///< What stands for B and provides terms.
  ConsistencyOptions options;
  std::vector<std::string> lock;    ///< "JOINT" or "JOINT=VALUE".
  std::vector<std::string> ignore;  ///< Words of kIgnorable, and links.
  bool exact = false;               ///< Two files agree to rounding only, whatever digits they print.
  double precision = 1.0;           ///< Coarsest printed precision that counts as agreement, per cent.

  /// Takes the shipped pair where no file was given. @param command for messages.
  /// @throws InputError when one file was given.
  void TakeFiles(const std::string& command) {
    files.TakeShipped();
    if (files.robot.empty()) throw InputError(command + ": B needs A, the file that may be wrong");
    if (files.mjcf.empty()) {
      throw InputError(command + ": takes two files, got " + files.robot.string() +
                       "; init, audit, judge take one");
    }
  }
  /// To what two files agree.
  [[nodiscard]] std::string DescribeTolerance() const {
    const std::optional<double> tolerance = judging.Find();
    return tolerance ? FormatNumber(*tolerance, 6) : "rounding";
  }
  /// Returns whether B is a source of terms, and no description.
  [[nodiscard]] bool has_results() const { return !source.program.empty() || !source.results.empty(); }
  /// Whether all states were compared; results in files have their own, and files of other joints none.
  [[nodiscard]] bool IsWhole(const ConsistencyResult& result) const {
    return result.samples >= options.samples || result.terms.empty() || !source.results.empty();
  }
};

/// Adds --digits, --tolerance, --exact and --precision.
void AddJudgingOptions(CLI::App* command, ConsistencyRequest* request);

/// Compares two files, or a file and the terms that stand in the place of the other, as the request says.
/// Every command that judges a pair of files does it by this function.
Comparison Compare(const ConsistencyRequest& request, const Progress& progress);
/// Compares two files that are read already.
Comparison Compare(const ConsistencyRequest& request, DescriptionFile* robot, DescriptionFile* mjcf,
                   const Progress& progress);

/// A compared term or constant: its record, where it was worst, and the two values there.
Json DescribeRecord(const CheckRecord& record, const RobotModel& model);

/// The result of a repair that was tried in memory.
struct RepairTrial {
  std::string command = {};  ///< Writes the corrected file; empty if the file would still differ.
  std::string left = {};     ///< What would still differ; empty for nothing, or where none can be written.
};

/// Repairs the file in which the causes are in memory, and compares it again.
RepairTrial TryRepair(const ConsistencyRequest& request, const Comparison& comparison);

/// Returns whether the two agree, and if not, why.
Answer MakeAnswer(const ConsistencyRequest& request, const Comparison& comparison, const RepairTrial& repair);

/// Returns what was compared and how it agrees. @param repair that the answer names.
Report MakeReport(const ConsistencyRequest& request, const Comparison& comparison, const RepairTrial& repair);

/// Adds "causes" and "unexplained", which is all that differs where terms alone are compared.
void AddCauses(const Comparison& comparison, Json* json);

}  // namespace dexcheck::cli
