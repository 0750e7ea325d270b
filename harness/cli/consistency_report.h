#pragma once

// The request of `consistency`, its results, and how they are printed.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "harness/base/answer.h"
#include "harness/cli/commands.h"
#include "harness/comparison/file_comparison.h"

namespace dexcheck::cli {

/// The two sides of a comparison, and the number of states.
struct ConsistencyRequest : ComparisonRequest {
  ResultsSource source;  ///< What stands for B and provides terms.
  ConsistencyOptions options;
  std::string page_file;            ///< Where the page of two files goes; empty for none.
  std::vector<std::string> lock;    ///< "JOINT" or "JOINT=VALUE".
  std::vector<std::string> ignore;  ///< Words of kIgnorable, and links.
  bool exact = false;               ///< Two files agree to rounding only, whatever digits they print.
  double precision = 1.0;           ///< Coarsest printed precision that counts as agreement, per cent.

  /// Returns whether B is a source of terms, and no description.
  [[nodiscard]] bool has_results() const { return !source.program.empty() || !source.results.empty(); }
  /// Whether all states were compared; results in files have their own, and files of other joints none.
  [[nodiscard]] bool IsWhole(const ConsistencyResult& result) const {
    return result.samples >= options.samples || result.terms.empty() || !source.results.empty();
  }
};

/// Adds --digits, --tolerance, --exact and --precision.
void AddJudgingOptions(Command command, ConsistencyRequest* request);

/// Compares two files, or a file and the terms that stand in the place of the other, as the request says.
/// Every command that judges a pair of files does it by this function.
Comparison Compare(const ConsistencyRequest& request, const Progress& progress);
/// Compares two files that are read already.
Comparison Compare(const ConsistencyRequest& request, DescriptionFile* robot, DescriptionFile* mjcf,
                   const Progress& progress);

/// A compared term or constant: its record, where it was worst, and the two values there.
nlohmann::ordered_json DescribeRecord(const CheckRecord& record, const RobotModel& model);

/// Large results first fail, then where to look: what a person reads.
void PrintTable(const ConsistencyRequest& request, const Comparison& comparison);
/// The result of a repair that was tried in memory.
struct RepairTrial {
  std::string command = {};  ///< Writes the corrected file; empty if the file would still differ.
  std::string left = {};     ///< What would still differ; empty for nothing, or where none can be written.
};

/// Returns whether the two agree, and if not, why.
Answer MakeAnswer(const ConsistencyRequest& request, const Comparison& comparison, const RepairTrial& repair);
/// Returns the results as JSON.
nlohmann::ordered_json ToJson(const ConsistencyRequest& request, const Comparison& comparison, ExitCode code);

/// Writes the results as a JUnit document.
std::string WriteJUnit(const ConsistencyRequest& request, const Comparison& comparison);

/// Adds "causes" and "unexplained", which is all that differs where terms alone are compared.
void AddCauses(const Comparison& comparison, nlohmann::ordered_json* json);

}  // namespace dexcheck::cli
