#include "harness/cli/output_file.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "controller/common/errors.h"

namespace dexcheck::cli {

OutputFile::OutputFile(const std::filesystem::path& path) : path_(path) {
  if (path.empty()) return;
  if (path == "-") {
    file_ = stdout;
    return;
  }
  std::error_code ignored;
  const std::filesystem::file_status status = std::filesystem::status(path, ignored);
  const bool in_place = std::filesystem::is_other(status);
  if (!in_place) partial_.emplace(path);
  file_ = std::fopen(in_place ? path.c_str() : partial_->partial().c_str(), "wb");
  if (file_ == nullptr) Fail(errno);
}

OutputFile::~OutputFile() {
  if (exists() && !is_stdout()) std::fclose(file_);
}

void OutputFile::Append(const std::string& text) {
  if (exists() && std::fwrite(text.data(), 1, text.size(), file_) != text.size()) Fail(errno);
}

void OutputFile::Finish() {
  if (exists() && std::fflush(file_) != 0) Fail(errno);
  if (!exists() || is_stdout()) return;
  if (partial_ && ::fsync(::fileno(file_)) != 0) Fail(errno);
  const int closed = std::fclose(std::exchange(file_, nullptr));
  if (closed != 0) Fail(errno);
  if (partial_) partial_->Commit();
}

void OutputFile::Fail(int error) const {
  const std::string name = path_ == "-" ? "standard output" : path_.string();
  throw InputError(name + ": cannot be written: " + std::strerror(error));
}

const std::filesystem::path& RequirePageName(const std::filesystem::path& path) {
  const std::string extension = ExtensionOf(path);
  const bool is_page = extension.empty() || extension == ".html" || extension == ".htm";
  if (is_page || IsFolder(path)) return path;  // a folder is refused as such
  throw InputError(path.string() + ": cannot be written: a page's name must end in .html");
}

}  // namespace dexcheck::cli
