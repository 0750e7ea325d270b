#pragma once

// A recorded run as the report needs it: signals by name, and its summary.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "harness/base/check_record.h"
#include "harness/log/log_reader.h"

namespace dexcheck {

/// One check of a run, over all its steps.
struct CheckLine {
  std::string name;
  CheckCategory kind = CheckCategory::kModel;
  std::string unit = "1";
  std::string description;
  double bound = 0.0;
  double max = 0.0;
  double at_time = 0.0;    ///< Of the maximum, s.
  double failed_at = 0.0;  ///< First time above the bound, s; meaningless when passed.
  bool pass = true;
  bool constant = false;  ///< Compared once, before the run, and not at each step.
  std::string where;      ///< Part of the robot that was worst; may be empty.

  /// max / bound; 0 for 0 / 0.
  [[nodiscard]] double fraction() const;
};

/// The log of a run.
class RunData {
 public:
  /// @throws InputError, one line that names the file, when the folder holds no log, or one without rows.
  explicit RunData(const std::filesystem::path& run_dir);

  [[nodiscard]] const LogReader& log() const { return log_; }
  /// Of the log.
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Of each row, s.
  [[nodiscard]] const VectorXd& time() const { return time_; }
  /// Null when it was not recorded.
  [[nodiscard]] const SignalInfo* Find(const std::string& signal) const;
  /// Name of a column: its own, or its number.
  [[nodiscard]] static std::string NameColumn(const SignalInfo& signal, int column);
  /// Empty when it is not in the log.
  [[nodiscard]] std::string FindText(const std::string& name) const { return log_.FindText(name); }
  /// Null when the run was cut off before its end.
  [[nodiscard]] const nlohmann::json& summary() const { return summary_; }
  /// Failed ones first, then by fraction of the bound, largest first.
  [[nodiscard]] const std::vector<CheckLine>& checks() const { return checks_; }

 private:
  void ReadSummary();
  void ReadChecksOfSummary();
  void ReadChecksOfSignals();

  std::filesystem::path path_;
  LogReader log_;
  VectorXd time_;
  nlohmann::json summary_;
  std::vector<CheckLine> checks_;
};

/// "the run was cut off after 120 steps" of a log without a summary, "the run was stopped by hand after ...",
/// "the run ended before its first step"; empty for a log that holds a whole run.
std::string DescribeCut(const LogReader& log);

}  // namespace dexcheck
