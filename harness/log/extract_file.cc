#include "harness/log/extract_file.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <cerrno>
#include <system_error>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/log/log_content.h"
#include "harness/log/log_file.h"

namespace dexcheck {
namespace {

/// Opens the folder that a file is to be in, step by step below `folder`.
FileDescriptor OpenParent(const std::filesystem::path& folder, const std::filesystem::path& name) {
  const std::filesystem::path parent = (folder / name).parent_path();
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) FailToWrite(parent, error.value());
  FileDescriptor place(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!place.is_open()) FailToWrite(parent, errno);
  for (const std::filesystem::path& part : name.parent_path()) {
    constexpr mode_t kMode = 0777;
    if (::mkdirat(place.get(), part.c_str(), kMode) != 0 && errno != EEXIST) FailToWrite(parent, errno);
    FileDescriptor next(::openat(place.get(), part.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
    if (!next.is_open()) FailToWrite(parent, errno);
    place = std::move(next);
  }
  return place;
}

}  // namespace

void ExtractFile(const std::filesystem::path& folder, const std::string& name, std::string_view bytes) {
  if (!IsPlainPath(name)) throw InputError(Quote(name) + ": must be a plain relative path");
  const FileDescriptor place = OpenParent(folder, name);
  constexpr int kFlags = O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC;
  constexpr mode_t kMode = 0666;
  const std::filesystem::path path = folder / name;
  FileDescriptor file(::openat(place.get(), path.filename().c_str(), kFlags, kMode));
  if (!file.is_open()) FailToWrite(path, errno);
  int error = WriteAt(file.get(), bytes.data(), bytes.size(), 0);
  if (error == 0) error = file.Close();
  if (error != 0) FailToWrite(path, error);
}

}  // namespace dexcheck
