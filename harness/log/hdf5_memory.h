#pragma once

// A file that HDF5 writes into memory. HDF5 1.10 cannot close a file on a full disk: it keeps the half-closed
// file and ends the program with a segmentation fault at its exit. So HDF5 gets a file that is never full,
// and what it wrote is put on disk without it.

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>

#include "harness/log/hdf5_handle.h"

namespace dexcheck::hdf5 {

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

}  // namespace dexcheck::hdf5
