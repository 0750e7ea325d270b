#pragma once

// Files as bytes, and folders for a while.

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "harness/base/temporary_path.h"

namespace dexcheck {

/// @throws InputError "PATH: cannot be read: reason".
std::string ReadBytes(const std::filesystem::path& path);

/// FNV-1a of 64 bits, as 16 hexadecimal digits: what a reader sees of bytes that differ.
std::string HashBytes(std::string_view bytes);

/// ".png" of "Picture.PNG": the extension with its dot, in small letters; "" without one.
std::string ExtensionOf(const std::filesystem::path& path);

/// A new empty folder in TMPDIR (/tmp unless it is set), removed with all that is in it at the end, also when
/// a signal ends the program.
class TemporaryFolder {
 public:
  /// @throws InputError "PATH: cannot be made: reason".
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  std::optional<TemporaryPath> protection_;
};

}  // namespace dexcheck
