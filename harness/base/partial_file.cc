#include "harness/base/partial_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <system_error>

#include "controller/common/errors.h"

namespace dexcheck {

PartialFile::PartialFile(const std::filesystem::path& target) : path_(target), target_(target) {
  namespace fs = std::filesystem;
  static std::atomic<int> count = 0;
  if (target.empty()) Fail("the name is empty");
  std::error_code error;
  const fs::file_status status = fs::status(target, error);
  if (fs::is_directory(status)) Fail(std::strerror(EISDIR));
  if (fs::exists(status)) {
    if (!fs::is_regular_file(status)) Fail("not a regular file");
    if (::access(target.c_str(), W_OK) != 0) Fail(std::strerror(errno));
    target_ = fs::canonical(target, error);
    if (error) Fail(error.message());
  }
  const std::string partial =
      target_.string() + ".partial-" + std::to_string(::getpid()) + "-" + std::to_string(count++);
  protection_.emplace(partial);
  const int descriptor = ::open(partial.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666);
  if (descriptor < 0) Fail(std::strerror(errno));
  ::close(descriptor);
  partial_ = partial;
}

PartialFile::~PartialFile() { Abort(); }

void PartialFile::Write(std::string_view bytes) const {
  errno = 0;
  std::ofstream stream(partial_, std::ios::binary);
  stream << bytes;
  stream.close();
  if (!stream) Fail(std::strerror(errno));
}

void PartialFile::Commit() {
  if (std::rename(partial_.c_str(), target_.c_str()) != 0) Fail(std::strerror(errno));
  partial_.clear();
  protection_.reset();
}

void PartialFile::Abort() {
  if (partial_.empty()) return;
  std::remove(partial_.c_str());
  partial_.clear();
  protection_.reset();
}

void PartialFile::Fail(const std::string& reason) const {
  throw InputError(path_.string() + ": cannot be written: " + reason);
}

}  // namespace dexcheck
