#pragma once

// Recorded runs side by side: what differs in their inputs, their verdicts and checks, and their signals; and
// the page of that.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "harness/base/answer.h"
#include "harness/report/run_data.h"

namespace dexcheck {

/// One input in which the runs differ.
struct InputDifference {
  std::string name;
  std::vector<std::string> values;  ///< One for each run; of a file its size and checksum.
};

/// One number that each run has, or none where a run lacks it.
struct ComparedNumber {
  std::string name;
  std::string unit;
  std::vector<std::optional<double>> values;  ///< One for each run.
  std::vector<bool> fails;                    ///< Likewise: whether it is above its bound.

  /// Value of a run over that of the first; none without either, or for 0 / 0.
  [[nodiscard]] std::optional<double> CalcRatio(size_t run) const;
  [[nodiscard]] bool fails_anywhere() const;
};

/// By how much a signal of a later run differs from the first run's, over the time that both cover. Where the
/// two were recorded at other times, the first run's values are compared with a line through the other's.
struct SignalDifference {
  std::string name;
  std::string unit;         ///< Of the column.
  std::string column;       ///< Where they differ most; empty for a signal of one number.
  int column_index = 0;     ///< Likewise.
  size_t run = 0;           ///< The later run.
  double difference = 0.0;  ///< The largest, in the unit; infinite where one of them alone is no number.
  double size = 0.0;        ///< Largest value of the two runs in all columns of that unit.
  double at_time = 0.0;     ///< Of the largest, s.
  double first_time = 0.0;  ///< When the difference is above the tolerance for the first time, s.
  bool differs = false;     ///< Whether it is above the tolerance.

  /// difference / size; 0 for 0 / 0.
  [[nodiscard]] double fraction() const;
  /// "object/X_o.x".
  [[nodiscard]] std::string NameColumn() const;
};

struct RunComparisonOptions {
  double tolerance = 0.0;             ///< Relative to a signal's size.
  std::vector<std::string> patterns;  ///< Of signals' names, as fnmatch has them; all without any.
};

struct RunComparison {
  double tolerance = 0.0;  ///< That signals are judged by, relative to their sizes.
  std::vector<InputDifference> inputs;
  std::vector<std::string> verdicts;      ///< One for each run: "pass", "disagreement: wheel slip".
  std::vector<ComparedNumber> results;    ///< Tracking errors, duration, effort.
  std::vector<ComparedNumber> checks;     ///< Largest value of each check, in the first run's order.
  std::vector<SignalDifference> signals;  ///< All that are compared, the largest fraction first.
  std::vector<std::string> not_compared;  ///< Signals that not all runs have, or not with the same columns.

  /// Whether verdicts, durations and signals are the same within the tolerance.
  [[nodiscard]] bool IsSame() const;
  /// The signal that differs first in time; null when none does.
  [[nodiscard]] const SignalDifference* FindFirst() const;
};

/// Compares the later runs with the first one. Residuals of checks (check/...) are compared by their largest
/// values only, since they are rounding.
/// @param runs at least two. @throws InputError when a log cannot be read, or a pattern matches nothing.
RunComparison CompareRuns(const std::vector<const RunData*>& runs, const RunComparisonOptions& options);

/// Values of a signal's column at the times of another run, by lines between its rows; not-a-number outside.
VectorXd Resample(const VectorXd& time, const Eigen::Ref<const VectorXd>& values, const VectorXd& at);

/// Returns SAME, or DIFFERENT with the signal that differs first.
Answer MakeAnswer(const RunComparison& comparison);

/// The JSON of `compare --json`, which its page shows. @param names of the runs, such as their folders.
nlohmann::ordered_json ToJson(const RunComparison& comparison, const std::vector<std::string>& names);

/// A whole HTML document that loads nothing: verdict, inputs that differ, results and checks side by side,
/// the signals that differ most, overlaid and subtracted.
/// @param names of the runs, such as their folders.
std::string MakeComparisonPage(const std::vector<const RunData*>& runs, const std::vector<std::string>& names,
                               const RunComparison& comparison);

}  // namespace dexcheck
