#include "harness/log/log_writer.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <system_error>

#include "controller/common/errors.h"
#include "controller/common/text.h"

namespace dexcheck {
namespace {

constexpr double kUnwritten = std::numeric_limits<double>::quiet_NaN();

/// HDF5 keeps all attributes of an object together in 64 kB; a name takes 16 bytes.
constexpr size_t kMaxNames = 3000;

[[noreturn]] void Refuse(const std::string& what, const std::string& requirement) {
  throw std::invalid_argument(what + ": " + requirement);
}

void RequirePlainPath(const std::string& kind, const std::string& name) {
  if (!IsPlainPath(name)) Refuse(kind + " " + Quote(name), "must be a relative path without . and ..");
}

/// Text that HDF5 would cut at the zero byte.
void RequireNoZeroByte(const std::string& what, const std::string& text) {
  if (text.find('\0') != std::string::npos) Refuse(what, "must not contain a zero byte");
}

void RequireUsable(const SignalInfo& signal) {
  const std::string what = "signal " + Quote(signal.name);
  RequirePlainPath("signal", signal.name);
  if (signal.name.find(',') != std::string::npos) Refuse(what, "must not contain a comma");
  Require(signal.width >= 1, what + ": width", "must be at least 1", signal.width);
  RequireNoZeroByte(what + ": unit", signal.unit);
  RequireNoZeroByte(what + ": description", signal.description);
  for (const std::string& column : signal.columns) RequireNoZeroByte(what + ": column", column);
  const size_t columns = signal.columns.size();
  Require(columns == 0 || columns == static_cast<size_t>(signal.width), what + ": columns",
          "must be none or one for each number", static_cast<double>(columns));
  Require(columns <= kMaxNames, what + ": columns", "must be at most 3000", static_cast<double>(columns));
  for (const char* name : {"unit", "description", "columns", ""}) {
    if (signal.attributes.contains(name)) Refuse(what + ": attribute " + Quote(name), "is not a free name");
  }
}

}  // namespace

LogWriter::LogWriter(const std::filesystem::path& path, long max_rows, long rows_per_flush)
    : name_(path.string()), max_rows_(max_rows), rows_per_flush_(static_cast<size_t>(rows_per_flush)) {
  Require(max_rows >= 1, "max_rows", "must be at least 1", static_cast<double>(max_rows));
  Require(rows_per_flush >= 1, "rows_per_flush", "must be at least 1", static_cast<double>(rows_per_flush));
  rows_per_flush_ = static_cast<size_t>(std::min(rows_per_flush, max_rows));
  std::error_code error;
  path_ = std::filesystem::absolute(path, error);
  if (error) Fail(error.value());
  // A bad path is known before long work starts.
  RequireNoFile();
  const PartialFile trial(path);
  content_.signals.push_back({"time", "s", "Simulated time", 1, {}, {}});
}

LogWriter::~LogWriter() {
  try {
    if (state_ == State::kRecording) Flush();
  } catch (const std::exception&) {
    // The rows up to the last flush are there; a destructor cannot report more.
    return;
  }
}

void LogWriter::RequireNoFile() const {
  struct stat status {};
  if (::lstat(path_.c_str(), &status) == 0) Fail(EEXIST);
  if (errno != ENOENT) Fail(errno);
}

void LogWriter::Fail(int error) const { FailToWrite(name_, error); }

void LogWriter::RequireState(bool condition, const char* call) const {
  if (condition) return;
  if (state_ == State::kFailed) throw InputError(name_ + ": cannot be written: it failed before");
  const char* const reason = state_ == State::kDescribing  ? "the rows have not been started"
                             : state_ == State::kRecording ? "the rows have been started"
                                                           : "the log is closed";
  Refuse(std::string(call) + " of log " + Quote(name_), reason);
}

void LogWriter::RequireFree(const std::string& name) const {
  const auto clashes = [&](const std::string& other) {
    return other == name || other.starts_with(name + "/") || name.starts_with(other + "/");
  };
  bool taken = clashes("meta");
  for (const SignalInfo& signal : content_.signals) taken |= clashes(signal.name);
  for (const EmbeddedFile& file : content_.files) taken |= clashes(file.path);
  if (taken) Refuse(Quote(name), "this name, or a part of it, is taken in the log");
}

void LogWriter::SetText(const std::string& name, const std::string& text) {
  RequireState(state_ != State::kClosed, "SetText");
  if (name.empty()) Refuse("text", "must have a name");
  RequireNoZeroByte("text's name " + Quote(name), name);
  RequireNoZeroByte("text " + Quote(name), text);
  const bool is_new = !content_.texts.contains(name);
  Require(!is_new || content_.texts.size() < kMaxNames / 4, "number of texts", "must be at most 750",
          static_cast<double>(content_.texts.size() + 1));
  content_.texts[name] = text;
  changed_ = true;
}

void LogWriter::EmbedFile(const std::string& group, const std::string& relative_name,
                          std::string_view bytes) {
  RequireState(state_ != State::kClosed, "EmbedFile");
  RequirePlainPath("group", group);
  RequirePlainPath("embedded file", relative_name);
  const std::string path = group + "/" + relative_name;
  RequireFree(path);
  content_.files.push_back({path, std::string(bytes)});
  changed_ = true;
}

int LogWriter::AddSignal(const SignalInfo& signal) {
  RequireState(state_ == State::kDescribing, "AddSignal");
  RequireUsable(signal);
  RequireFree(signal.name);
  Require(content_.signals.size() < kMaxNames, "number of signals", "must be at most 3000",
          static_cast<double>(content_.signals.size() + 1));
  content_.signals.push_back(signal);
  return static_cast<int>(content_.signals.size()) - 1;
}

void LogWriter::StartRows() {
  RequireState(state_ == State::kDescribing, "StartRows");
  size_t row_size = 0;
  for (const SignalInfo& signal : content_.signals) row_size += static_cast<size_t>(signal.width);
  numbers_.assign(row_size * rows_per_flush_, kUnwritten);
  double* begin = numbers_.data();
  for (const SignalInfo& signal : content_.signals) {
    const auto width = static_cast<size_t>(signal.width);
    buffers_.push_back({begin, width});
    begin += width * rows_per_flush_;
  }
  PartialFile partial(path_);
  file_ = WriteLogFile(partial.partial(), name_, content_, max_rows_);
  RequireNoFile();
  partial.Commit();
  changed_ = false;
  state_ = State::kRecording;
}

void LogWriter::EndRow() {
  RequireState(state_ == State::kRecording, "EndRow");
  Require(std::isfinite(buffers_[kTime].begin[buffered_rows_]), "time of a row", "must be finite",
          buffers_[kTime].begin[buffered_rows_]);
  Require(rows() < max_rows_, "rows of a log", "must not exceed max_rows", static_cast<double>(rows() + 1));
  ++buffered_rows_;
  if (buffered_rows_ == rows_per_flush_) Flush();
}

void LogWriter::Flush() {
  RequireState(state_ == State::kRecording, "Flush");
  state_ = State::kFailed;  // unless all of this succeeds
  WriteBufferedRows();
  CheckFileIsThere();
  for (const Buffer& buffer : buffers_) {
    // One more than the complete rows: the caller may have begun the next.
    const size_t used = std::min(buffered_rows_ + 1, rows_per_flush_) * buffer.width;
    std::fill_n(buffer.begin, used, kUnwritten);
  }
  flushed_rows_ += static_cast<long>(buffered_rows_);
  buffered_rows_ = 0;
  state_ = State::kRecording;
}

/// Time is last: once a row has its time, it has everything.
void LogWriter::WriteBufferedRows() {
  for (size_t k = buffers_.size(); k-- > 0;) {
    const size_t row_size = buffers_[k].width * sizeof(double);
    WriteAt(name_, file_.get(), buffers_[k].begin, buffered_rows_ * row_size,
            file_.offsets[k] + static_cast<size_t>(flushed_rows_) * row_size);
  }
}

/// Writing to a file that was removed succeeds, and is in vain.
void LogWriter::CheckFileIsThere() const {
  struct stat status {};
  if (::fstat(file_.get(), &status) != 0) Fail(errno);
  if (status.st_nlink == 0) throw InputError(name_ + ": cannot be written: it was removed");
}

void LogWriter::Close() {
  if (state_ == State::kFailed) {
    file_.Close();
    state_ = State::kClosed;
    return;
  }
  RequireState(state_ == State::kRecording, "Close");
  Flush();
  state_ = State::kFailed;  // unless all of this succeeds
  if (changed_ || flushed_rows_ < max_rows_) Rewrite();
  if (const int error = file_.Close(); error != 0) Fail(error);
  state_ = State::kClosed;
}

/// Builds the final file beside the present one, and replaces it at once.
void LogWriter::Rewrite() {
  PartialFile partial(path_);
  LogFile file = WriteLogFile(partial.partial(), name_, content_, flushed_rows_);
  for (size_t k = 0; k < buffers_.size(); ++k) {
    const size_t size = buffers_[k].width * sizeof(double) * static_cast<size_t>(flushed_rows_);
    CopyBytes(name_, file_.get(), file_.offsets[k], file.get(), file.offsets[k], size);
  }
  if (::fsync(file.get()) != 0) Fail(errno);
  if (const int error = file.Close(); error != 0) Fail(error);
  struct stat ours {};
  struct stat there {};
  if (::fstat(file_.get(), &ours) != 0 || ::stat(path_.c_str(), &there) != 0) Fail(errno);
  if (ours.st_dev != there.st_dev || ours.st_ino != there.st_ino) {
    throw InputError(name_ + ": cannot be written: another file has taken its place");
  }
  partial.Commit();
}

}  // namespace dexcheck
