#pragma once

// What must not outlive the program when a signal ends it: files and folders under construction, and the
// processes that write them.

#include <sys/types.h>

#include <cstddef>
#include <filesystem>

namespace dexcheck {

/// While it lives, the file or folder of this name is removed when a signal ends the program; otherwise its
/// owner removes or renames it. Only this process removes it, no child that it forks.
class TemporaryPath {
 public:
  /// @param path with all that is in it, when it is a folder. A path too long for the system, or one more
  /// than the program's table holds, is not protected.
  explicit TemporaryPath(const std::filesystem::path& path);
  ~TemporaryPath();
  TemporaryPath(const TemporaryPath&) = delete;
  TemporaryPath& operator=(const TemporaryPath&) = delete;

 private:
  size_t slot_;
};

/// While it lives, this child is killed before the temporary paths are removed. One at a time.
class TemporaryChild {
 public:
  explicit TemporaryChild(pid_t child);
  ~TemporaryChild();
  TemporaryChild(const TemporaryChild&) = delete;
  TemporaryChild& operator=(const TemporaryChild&) = delete;
};

/// Ends the child and removes the paths. Calls only what a signal's handler may call.
void RemoveTemporaryPaths();

}  // namespace dexcheck
