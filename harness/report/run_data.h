#pragma once

// A recorded run as the report needs it: signals by name, and its summary; and as drawing needs it.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "harness/base/check_record.h"
#include "harness/engine/engine.h"
#include "harness/log/log_reader.h"
#include "renders/viewpoint.h"

namespace dexcheck {

/// The log of a run.
class RunData {
 public:
  /// @throws InputError, one line that names the file, when the folder holds no log, or one without rows.
  explicit RunData(const std::filesystem::path& run_dir);

  [[nodiscard]] const LogReader& log() const { return log_; }
  /// Times of the rows, s.
  [[nodiscard]] const VectorXd& time() const { return time_; }
  [[nodiscard]] double end() const { return time_[time_.size() - 1]; }
  /// Null when it was not recorded.
  [[nodiscard]] const SignalInfo* Find(const std::string& signal) const { return log_.Find(signal); }
  /// Whether the robot holds nothing, and its joints follow a motion of their own.
  [[nodiscard]] bool moves_joints() const { return Find("joints/q_d") != nullptr; }
  /// Describes in a few words what a category compares in this run.
  [[nodiscard]] const char* Explain(CheckCategory category) const;
  /// Name of a column: its own, or its number.
  [[nodiscard]] static std::string NameColumn(const SignalInfo& signal, int column);
  /// Empty when it is not in the log.
  [[nodiscard]] std::string FindText(const std::string& name) const { return log_.FindText(name); }

  /// Whether the run was cut off before its end; it has no summary then.
  [[nodiscard]] bool is_cut_off() const { return summary_.empty(); }
  /// An empty object for none.
  [[nodiscard]] const nlohmann::json& summary() const { return summary_; }
  /// A text or a number of the summary, by its place: "/attribution/cause". Empty, not-a-number for none.
  [[nodiscard]] std::string FindSummaryText(const char* pointer) const;
  [[nodiscard]] double FindSummaryNumber(const char* pointer) const;
  /// Failed ones first, then by fraction of the bound, largest first.
  [[nodiscard]] const std::vector<CheckRecord>& checks() const { return checks_; }
  /// Returns whether the run is one of the paper's, whose figures have the paper's numbers.
  [[nodiscard]] bool is_papers() const { return FindText("scenario").starts_with("paper"); }

 private:
  void ReadChecksOfSummary();
  void ReadChecksOfSignals();

  LogReader log_;
  VectorXd time_;
  nlohmann::json summary_ = nlohmann::json::object();
  std::vector<CheckRecord> checks_;
};

/// "the run was cut off after 120 steps" of a log without a summary, "the run was stopped by hand after ...",
/// "the run ended before its first step"; empty for a log that holds a whole run.
std::string DescribeCut(const LogReader& log);

/// The check that a signal "check/NAME" belongs to, without values. @throws InputError that names what lacks.
CheckRecord ReadCheckInfo(const LogReader& log, const SignalInfo& signal);

/// Path of the robot ("robot") or the model ("mjcf") that a log names, once its files are unpacked.
/// @throws InputError when the log holds no such file, or the model names files outside its folder.
std::filesystem::path FindEmbedded(const LogReader& log, const std::string& kind,
                                   const std::filesystem::path& unpacked);

/// A recorded run, ready to be drawn.
struct RecordedFrames {
  MjModelPtr model;  ///< From the MJCF that the log keeps.
  RunFrames frames;
};

/// From a log, or from RUN_DIR/log.h5. Only time, engine/qpos and the MJCF must be there; what else is
/// missing is not drawn.
/// @throws InputError that names the log and what is wrong with it.
RecordedFrames ReadRecordedFrames(const LogReader& log);
RecordedFrames ReadRecordedFrames(const std::filesystem::path& run_folder);

}  // namespace dexcheck
