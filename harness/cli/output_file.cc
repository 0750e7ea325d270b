#include "harness/cli/output_file.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "controller/common/errors.h"

namespace dexcheck::cli {

OutputFile::OutputFile(const std::filesystem::path& path) : path_(path), target_(path) {
  namespace fs = std::filesystem;
  if (path == "-") {
    file_ = stdout;
    return;
  }
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::is_directory(status)) Fail(EISDIR);
  if (fs::exists(status)) {
    if (::access(path.c_str(), W_OK) != 0) Fail(errno);
    target_ = fs::canonical(path, error);
    if (error) Fail(error.value());
  }
  const bool in_place = fs::exists(status) && !fs::is_regular_file(status);
  if (!in_place) partial_ = target_.string() + ".partial-" + std::to_string(::getpid());
  file_ = std::fopen(in_place ? target_.c_str() : partial_.c_str(), "wb");
  if (file_ == nullptr) {
    partial_.clear();
    Fail(errno);
  }
}

OutputFile::~OutputFile() {
  if (file_ != nullptr && !is_stdout()) std::fclose(file_);
  if (!partial_.empty()) std::remove(partial_.c_str());
}

void OutputFile::Write(const std::string& text) {
  Append(text);
  Finish();
}

void OutputFile::Append(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), file_) != text.size()) Fail(errno);
}

void OutputFile::Finish() {
  if (std::fflush(file_) != 0) Fail(errno);
  if (is_stdout()) return;
  if (!partial_.empty() && ::fsync(::fileno(file_)) != 0) Fail(errno);
  const int closed = std::fclose(std::exchange(file_, nullptr));
  if (closed != 0) Fail(errno);
  if (partial_.empty()) return;
  if (std::rename(partial_.c_str(), target_.c_str()) != 0) Fail(errno);
  partial_.clear();
}

void OutputFile::Fail(int error) const {
  const std::string name = path_ == "-" ? "standard output" : path_.string();
  throw InputError(name + ": cannot be written: " + std::strerror(error));
}

}  // namespace dexcheck::cli
