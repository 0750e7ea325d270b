#include "harness/common/files.h"

#include <stdlib.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <system_error>

#include "controller/common/errors.h"

namespace dexcheck {

std::string ReadBytes(const std::filesystem::path& path) {
  const auto fail = [&](int error) {
    throw InputError(path.string() + ": cannot be read: " + std::strerror(error));
  };
  if (std::error_code ignored; std::filesystem::is_directory(path, ignored)) fail(EISDIR);
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) fail(errno);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  if (file.bad()) fail(errno);
  return bytes;
}

TemporaryFolder::TemporaryFolder() {
  std::string pattern = (std::filesystem::temp_directory_path() / "dexcheck-XXXXXX").string();
  if (::mkdtemp(pattern.data()) == nullptr) {
    throw InputError(pattern + ": cannot be made: " + std::strerror(errno));
  }
  path_ = pattern;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace dexcheck
