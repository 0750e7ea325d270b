#pragma once

// The log as bytes in a file. A log is an HDF5 file behind a user block of 512 bytes, the seal: lines of text
// that give the file's size, where its variable part lies (the rows' numbers and the reserved texts), and a
// checksum of everything else. HDF5 writes everything else once and closes the file; after that only the
// variable part is written, in place, so that a process that dies cannot leave a file that HDF5 does not
// open.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "harness/log/log_content.h"

namespace dexcheck {

/// @throws InputError "PATH: cannot be written: reason", the reason from the system's error number.
[[noreturn]] void FailToWrite(const std::filesystem::path& path, int error);
/// @throws InputError "PATH: cannot be read: reason".
[[noreturn]] void FailToRead(const std::filesystem::path& path, int error);

/// An owned file descriptor.
class FileDescriptor {
 public:
  explicit FileDescriptor(int descriptor = -1) : descriptor_(descriptor) {}
  ~FileDescriptor();
  FileDescriptor(FileDescriptor&& other) noexcept;
  FileDescriptor& operator=(FileDescriptor&& other) noexcept;

  [[nodiscard]] int get() const { return descriptor_; }
  [[nodiscard]] bool is_open() const { return descriptor_ >= 0; }
  /// 0, or the system's error number.
  int Close();

 private:
  int descriptor_;
};

/// Writes all bytes at the offset, or returns the system's error number; 0 is success.
int WriteAt(int descriptor, const void* bytes, size_t count, std::uint64_t offset);

/// Reads all bytes at the offset, or returns the system's error number; 0 is success, EIO a file that ends
/// before.
int ReadExactly(int descriptor, void* bytes, size_t count, std::uint64_t offset);

/// Copies bytes between files, or returns the system's error number; 0 is success.
int CopyBytes(int from, std::uint64_t from_offset, int to, std::uint64_t to_offset, size_t count);

/// Where lies what may be written after the file was made: offsets from the file's begin.
struct LogLayout {
  std::vector<std::uint64_t> signals;  ///< Each signal's first row; 0 without rows.
  std::map<std::string, std::uint64_t> reserved_texts;
};

/// The text and zero bytes up to the capacity, as it stands in the file.
std::string Pad(const ReservedText& reserved);

/// Writes a log with room for `rows` rows of each signal; times are NaN, which marks rows not written, other
/// numbers zero. `path` must not exist.
/// @param name in messages.
/// @throws InputError when the file cannot be written.
LogLayout WriteLogFile(const std::filesystem::path& path, const std::string& name, const LogContent& content,
                       long rows);

/// Size of the seal, and the HDF5 file's offset.
inline constexpr std::uint64_t kSealSize = 512;

/// Compares a file with its seal.
/// @throws InputError that names the file and says what is wrong: not a log, cut short, or damaged.
void CheckSeal(int descriptor, const std::filesystem::path& path);

/// Writes the seal of a finished file whose variable part lies at [begin, end).
/// @return 0, or the system's error number.
int WriteSeal(int descriptor, std::uint64_t begin, std::uint64_t end);

}  // namespace dexcheck
