#pragma once

// Writes the log of a run: every signal at every step, with units and descriptions, and whatever is needed to
// repeat the run. harness/log/README.md describes the file.

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "harness/base/files.h"
#include "harness/log/log_content.h"

namespace dexcheck {

/// A log under construction. Signals, texts and files come first; then StartRows, and for each step Row for
/// each signal and EndRow; then Close. From StartRows on the file can be read at any moment, whatever happens
/// to this process, and holds all rows up to the last flush; before, nothing stands under its name.
///
/// Every member throws InputError "PATH: cannot be written: reason" when the file system refuses, and
/// std::invalid_argument for a caller's fault (a name used twice, a call out of order).
class LogWriter {
 public:
  /// Signal 0, "time", s. Its value must be finite in every row: NaN marks rows that were not written.
  static constexpr int kTime = 0;
  static constexpr long kDefaultRowsPerFlush = 100;

  /// Nothing may stand under `path` yet; an existing file is an InputError.
  /// @param max_rows room in the file; costs no disk space until it is used.
  LogWriter(const std::filesystem::path& path, long max_rows, long rows_per_flush = kDefaultRowsPerFlush);
  /// Without Close: writes complete rows when it can, and leaves the file as a killed process would.
  ~LogWriter();

  /// Keeps a text in the group "meta", as an attribute; replaces one of the same name. After StartRows it
  /// reaches the file at Close, which then writes the whole file anew.
  void SetText(const std::string& name, const std::string& text);

  /// Keeps a file as GROUP/RELATIVE_NAME, bytes exact. After StartRows it reaches the file at Close.
  /// @param relative_name with / between folders: "mjcf/assets/torus.msh".
  void EmbedFile(const std::string& group, const std::string& relative_name, std::string_view bytes);

  /// Before StartRows. @return the signal's number, for Row.
  int AddSignal(const SignalInfo& signal);

  /// Creates the file.
  void StartRows();

  /// This row's numbers of a signal, to be written; NaN before. Valid until EndRow or Flush.
  std::span<double> Row(int signal) {
    const Buffer& buffer = buffers_[static_cast<size_t>(signal)];
    return {buffer.begin + buffered_rows_ * buffer.width, buffer.width};
  }

  /// The row is complete. Allocates nothing, and writes to the file only once in rows_per_flush rows.
  void EndRow();

  /// Writes complete rows to the file; a row under construction is lost.
  void Flush();

  /// Writes what remains; makes the file as long as the rows written, and adds late texts and files. Until
  /// that is done the file is the one before, whatever happens. After a failure to write it only closes the
  /// file.
  void Close();

  /// Complete rows, flushed or not.
  [[nodiscard]] long rows() const { return flushed_rows_ + static_cast<long>(buffered_rows_); }

 private:
  enum class State { kDescribing, kRecording, kFailed, kClosed };

  /// Rows not yet in the file, of one signal.
  struct Buffer {
    double* begin;
    size_t width;
  };

  void RequireState(bool condition, const char* call) const;
  void RequireNoFile() const;
  void RequireFree(const std::string& name) const;
  void WriteBufferedRows();
  void CheckFileIsThere() const;
  void Rewrite();
  [[noreturn]] void Fail(int error) const;

  std::string name_;            // as given, for messages
  std::filesystem::path path_;  // absolute
  long max_rows_;
  size_t rows_per_flush_;
  State state_ = State::kDescribing;
  bool changed_ = false;  // texts or files that are not yet in the file
  LogContent content_;
  LogFile file_;
  std::vector<double> numbers_;  // all buffers
  std::vector<Buffer> buffers_;
  size_t buffered_rows_ = 0;
  long flushed_rows_ = 0;
};

}  // namespace dexcheck
