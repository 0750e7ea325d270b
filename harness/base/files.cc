#include "harness/base/files.h"

#include <stdlib.h>

#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <system_error>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/interrupts.h"

namespace dexcheck {

std::string ReadBytes(const std::filesystem::path& path) {
  const auto fail = [&](const std::string& why) {
    throw InputError(path.string() + ": cannot be read: " + why);
  };
  if (std::error_code ignored; std::filesystem::is_directory(path, ignored)) fail("is a directory");
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) fail(std::strerror(errno));
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  if (file.bad()) fail(std::strerror(errno));
  return bytes;
}

std::string HashBytes(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string digits;
  for (int shift = 60; shift >= 0; shift -= 4) digits += kDigits[(hash >> shift) & 15U];
  return digits;
}

std::string ExtensionOf(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = 'A' <= c && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return extension;
}

TemporaryFolder::TemporaryFolder() {
  std::error_code error;
  const std::filesystem::path parent = std::filesystem::temp_directory_path(error);
  if (error) {
    const char* const named = std::getenv("TMPDIR");
    throw InputError("TMPDIR: must name a folder, got " + Quote(named == nullptr ? "/tmp" : named));
  }
  const HeldSignals until_protected;
  std::string pattern = (parent / "dexcheck-XXXXXX").string();
  if (::mkdtemp(pattern.data()) == nullptr) {
    throw InputError(pattern + ": cannot be made: " + std::strerror(errno));
  }
  path_ = pattern;
  protection_.emplace(path_);
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace dexcheck
