#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "controller/common/types.h"
#include "harness/log/log_content.h"
#include "harness/log/log_file.h"
#include "harness/log/log_structure.h"

namespace dexcheck {

/// Reads logs that LogWriter wrote, also unfinished ones: of a killed run, or of one that still goes on.
/// Every member throws InputError, one line that names the file and says what is wrong.
class LogReader {
 public:
  /// Opens the log and compares everything but its numbers with the checksum.
  explicit LogReader(const std::filesystem::path& path);
  LogReader(const LogReader&) = delete;
  LogReader& operator=(const LogReader&) = delete;

  /// In the order in which they were added; the first is time.
  [[nodiscard]] const std::vector<SignalInfo>& signals() const { return signals_; }
  /// Rows written, as far as they were flushed when the log was opened.
  [[nodiscard]] long rows() const { return rows_; }

  /// rows() x width numbers in the signal's unit.
  [[nodiscard]] RowMatrixXd ReadSignal(const std::string& name) const;

  /// Names of the texts, sorted.
  [[nodiscard]] std::vector<std::string> ListTexts() const;
  [[nodiscard]] std::string ReadText(const std::string& name) const;
  /// Likewise; empty when there is none of that name.
  [[nodiscard]] std::string FindText(const std::string& name) const;

  /// Relative names of the files embedded under a group, sorted; none is an error.
  [[nodiscard]] std::vector<std::string> ListFiles(const std::string& group) const;
  [[nodiscard]] std::string ReadFile(const std::string& group, const std::string& relative_name) const;

  /// Writes the files of a group into a folder, which it makes when it is not there. What it cannot write is
  /// an error, and so is a file that is already there; links in that folder are not followed.
  void ExtractFiles(const std::string& group, const std::filesystem::path& folder) const;

 private:
  void CountRows();
  void Read(std::uint64_t begin, size_t count, void* out) const;
  [[nodiscard]] std::string ReadRange(const ByteRange& range) const;

  std::filesystem::path path_;
  FileDescriptor file_;
  LogStructure structure_;
  std::vector<SignalInfo> signals_;
  long rows_ = 0;
};

}  // namespace dexcheck
