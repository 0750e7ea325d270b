#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "controller/common/types.h"
#include "harness/log/log_content.h"

namespace dexcheck {

/// Reads logs that LogWriter wrote, also unfinished ones: of a killed run, or of one that still goes on. A
/// log of format 1 is read as if it had today's names (log_content.h). Every member throws InputError, one
/// line that names the file and says what is wrong.
class LogReader {
 public:
  /// Opens the log. A child process reads its structure first, since HDF5 1.10 crashes on some damaged files.
  explicit LogReader(const std::filesystem::path& path);
  ~LogReader();

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// In the order in which they were added; the first is time.
  [[nodiscard]] const std::vector<SignalInfo>& signals() const { return signals_; }
  /// Null when it was not recorded.
  [[nodiscard]] const SignalInfo* Find(const std::string& signal) const;
  /// Rows written, as far as they were flushed when the log was opened.
  [[nodiscard]] long rows() const { return rows_; }

  /// rows() x width numbers in the signal's unit.
  [[nodiscard]] RowMatrixXd ReadSignal(const std::string& name) const;

  /// Names of the texts, sorted.
  [[nodiscard]] std::vector<std::string> ListTexts() const;
  [[nodiscard]] std::string ReadText(const std::string& name) const;
  /// The text of that name; empty when there is none.
  [[nodiscard]] std::string FindText(const std::string& name) const;

  /// Relative names of the files embedded under a group, sorted; none is an error.
  [[nodiscard]] std::vector<std::string> ListFiles(const std::string& group) const;
  [[nodiscard]] std::string ReadFile(const std::string& group, const std::string& relative_name) const;

  /// Writes the files of a group into a folder, which it makes when it is not there. What it cannot write is
  /// an error, and so is a file that is already there.
  void ExtractFiles(const std::string& group, const std::filesystem::path& folder) const;

 private:
  class File;

  std::filesystem::path path_;
  std::unique_ptr<File> file_;
  std::vector<SignalInfo> signals_;
  long rows_ = 0;
};

/// The signals whose names match one of these patterns, as fnmatch has them, in the log's order; all of them
/// without patterns. @throws InputError "--signals: no signal matches ..." of a pattern that matches none.
std::vector<SignalInfo> ChooseSignals(const LogReader& log, const std::vector<std::string>& patterns);

}  // namespace dexcheck
