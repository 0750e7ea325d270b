#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "harness/base/temporary_path.h"

namespace dexcheck {

/// A file that is written under a temporary name beside its target and takes the target's name when it is
/// complete. Destroyed before that, it leaves nothing behind; nor does a signal that ends the program.
class PartialFile {
 public:
  /// Creates the temporary file, so that a bad path is known before long work starts.
  /// @throws InputError "PATH: cannot be written: reason".
  explicit PartialFile(const std::filesystem::path& target);
  ~PartialFile();
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;

  /// Where to write.
  [[nodiscard]] const std::filesystem::path& partial() const { return partial_; }

  /// Puts these bytes into it, in the place of what was there. @throws InputError as the constructor.
  void Write(std::string_view bytes) const;

  /// Gives the file its name. @throws InputError as the constructor.
  void Commit();
  /// Removes the temporary file.
  void Abort();

  /// @throws InputError "PATH: cannot be written: reason".
  [[noreturn]] void Fail(const std::string& reason) const;

 private:
  std::filesystem::path path_;     // as given, for messages
  std::filesystem::path target_;   // links followed
  std::filesystem::path partial_;  // empty once committed or removed
  std::optional<TemporaryPath> protection_;
};

}  // namespace dexcheck
