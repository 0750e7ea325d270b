#pragma once

// The log as bytes in a file. HDF5 writes everything but the numbers once and closes the file; after that
// only these are written, in place, so that a process that dies cannot leave a file that HDF5 does not open.

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "harness/base/file_descriptor.h"
#include "harness/log/hdf5_handle.h"
#include "harness/log/log_content.h"

namespace dexcheck {

/// @throws InputError "PATH: cannot be written: reason", the reason from the system's error number.
[[noreturn]] void FailToWrite(const std::filesystem::path& path, int error);
/// @throws InputError "PATH: cannot be read: reason".
[[noreturn]] void FailToRead(const std::filesystem::path& path, int error);

/// Writes all bytes at the offset, or returns the system's error number; 0 is success.
int WriteAt(int descriptor, const void* bytes, size_t count, std::uint64_t offset);

/// Copies bytes between files, or returns the system's error number; 0 is success.
int CopyBytes(int from, std::uint64_t from_offset, int to, std::uint64_t to_offset, size_t count);

/// The root's attribute that says how a log is laid out and which names it uses; logs of format 1 have none.
inline constexpr const char* kFormatAttribute = "format";
inline constexpr const char* kLogFormat = "dexcheck log 2";

/// Writes a log with room for `rows` rows of each signal; times are NaN, which marks rows not written, other
/// numbers zero. `path` must exist.
/// @param name in messages.
/// @returns where each signal's first row lies, from the file's begin; 0 without rows.
/// @throws InputError when the file cannot be written.
std::vector<std::uint64_t> WriteLogFile(const std::filesystem::path& path, const std::string& name,
                                        const LogContent& content, long rows);

// A file that HDF5 writes into memory. HDF5 1.10 cannot close a file on a full disk: it keeps the half-closed
// file and ends the program with a segmentation fault at its exit. So HDF5 gets a file that is never full,
// and what it wrote is put on disk without it.

/// Bytes at any offset; what was never written is zero and takes no memory.
class MemoryImage {
 public:
  static constexpr size_t kPageSize = 4096;
  using Page = std::array<unsigned char, kPageSize>;

  void Read(std::uint64_t offset, size_t count, unsigned char* out) const;
  void Write(std::uint64_t offset, size_t count, const unsigned char* bytes);

  /// By page number; page n begins at n * kPageSize.
  [[nodiscard]] const std::map<std::uint64_t, Page>& pages() const { return pages_; }

  /// As HDF5 means the file to be, written or not.
  [[nodiscard]] std::uint64_t size() const { return size_; }
  void set_size(std::uint64_t size) { size_ = size; }

 private:
  std::map<std::uint64_t, Page> pages_;
  std::uint64_t size_ = 0;
};

using Driver = Handle<H5FDunregister>;

/// Registers the driver. It must outlive the files that use it.
Driver RegisterMemoryDriver();

/// Makes files opened with these properties be written to `image`, which must outlive them.
void UseMemory(const Driver& driver, const Properties& access, MemoryImage* image);

}  // namespace dexcheck
