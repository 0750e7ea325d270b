#pragma once

// Files as bytes, and folders for a while.

#include <sys/types.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace dexcheck {

// Files and folders under construction, and the processes that write them: none outlives the program when a
// signal ends it.

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

/// Notes that a file is read, so that no output replaces it; a name without a file is passed over.
/// @throws InputError when the file is also being written under this or another name.
void NoteInput(const std::filesystem::path& path);

/// The largest files that are read whole, in bytes: texts, and files of numbers or meshes. A pipe or a
/// device, which may never end, gives at most kMostText.
inline constexpr std::uintmax_t kMostText = std::uintmax_t{1} << 26U;
inline constexpr std::uintmax_t kMostData = std::uintmax_t{1} << 32U;

/// Returns the whole file, and notes it as an input.
/// @param shown the file in messages, when not its path.
/// @throws InputError "PATH: cannot be read: reason".
std::string ReadBytes(const std::filesystem::path& path, std::uintmax_t most = kMostText,
                      const std::string& shown = "");

/// Bytes that a stated size may ask for: content that is packed in `stored` bytes of a file.
constexpr std::uintmax_t MostUnpacked(std::uintmax_t stored) {
  constexpr std::uintmax_t kAlways = std::uintmax_t{1} << 27U;
  constexpr std::uintmax_t kRatio = 32;
  return kAlways + kRatio * stored;
}

// Calls of the file system that answer "no" instead of throwing what std::filesystem throws: names that are
// too long, loops of links, folders that may not be read. Whoever opens such a file says why it cannot.

bool Exists(const std::filesystem::path& path);
bool IsFolder(const std::filesystem::path& path);
/// The size of a file in bytes; 0 for what has none.
std::uintmax_t SizeOf(const std::filesystem::path& path);
/// The folder that names are relative to. @throws InputError when it was removed.
std::filesystem::path CurrentFolder();
/// The path from the root, links and ".." as they stand. @throws InputError as CurrentFolder.
std::filesystem::path MakeAbsolute(const std::filesystem::path& path);
/// Makes a folder and those above it. @throws InputError "PATH: cannot be made: reason".
void MakeFolder(const std::filesystem::path& path);
/// Returns what is in a folder, by name. @throws InputError "PATH: cannot be read: reason".
std::vector<std::filesystem::path> ListFolder(const std::filesystem::path& folder);

/// FNV-1a of 64 bits, as 16 hexadecimal digits: what a reader sees of bytes that differ.
std::string HashBytes(std::string_view bytes);

/// Path of a file or folder installed with this program. @param name relative to the folder above the
/// program's own: "share/dexcheck". Links are followed; it need not exist.
std::filesystem::path FindInstalled(const std::filesystem::path& name);

/// ".png" of "Picture.PNG": the extension with its dot, in small letters; "" without one.
std::string ExtensionOf(const std::filesystem::path& path);

/// A new empty folder in TMPDIR (/tmp unless it is set), removed with all that is in it at the end, also when
/// a signal ends the program.
class TemporaryFolder {
 public:
  /// @throws InputError "PATH: cannot be made: reason".
  TemporaryFolder();
  ~TemporaryFolder();
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  std::optional<TemporaryPath> protection_;
};

/// A file that is written under a temporary name beside its target and takes the target's name when it is
/// complete. Destroyed before that, it leaves nothing behind; nor does a signal that ends the program. A
/// target that is an input of this process, by device and inode, is refused.
class PartialFile {
 public:
  /// Creates the temporary file, so that a bad path is known before long work starts.
  /// @throws InputError "PATH: cannot be written: reason".
  explicit PartialFile(const std::filesystem::path& target);
  ~PartialFile();

  /// Path to write to.
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
  /// @throws InputError when the target is a file that this process has read.
  void RefuseInput() const;
  /// Its temporary file is gone.
  void Release();

  std::filesystem::path path_;     // as given, for messages
  std::filesystem::path target_;   // links followed
  std::filesystem::path partial_;  // empty once committed or removed
  std::optional<TemporaryPath> protection_;
};

/// Writes a whole file, in a folder that is made where it is not there. @throws InputError as PartialFile.
void WriteFile(const std::filesystem::path& path, std::string_view bytes);

/// An owned file descriptor.
class FileDescriptor {
 public:
  explicit FileDescriptor(int descriptor = -1) : descriptor_(descriptor) {}
  ~FileDescriptor() { Close(); }
  FileDescriptor(FileDescriptor&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    return *this;
  }

  [[nodiscard]] int get() const { return descriptor_; }
  [[nodiscard]] bool is_open() const { return descriptor_ >= 0; }
  /// 0, or the system's error number.
  int Close() {
    if (!is_open()) return 0;
    return ::close(std::exchange(descriptor_, -1)) == 0 ? 0 : errno;
  }

 private:
  int descriptor_;
};

}  // namespace dexcheck
