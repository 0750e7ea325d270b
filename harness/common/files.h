#pragma once

// Files as bytes, and folders for a while.

#include <filesystem>
#include <string>

namespace dexcheck {

/// @throws InputError "PATH: cannot be read: reason".
std::string ReadBytes(const std::filesystem::path& path);

/// A new empty folder, removed with all that is in it at the end.
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
};

}  // namespace dexcheck
