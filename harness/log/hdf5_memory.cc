#include "harness/log/hdf5_memory.h"

#include <algorithm>
#include <cstring>
#include <exception>
#include <limits>
#include <new>

namespace dexcheck::hdf5 {
namespace {

constexpr herr_t kSuccess = 0;
constexpr herr_t kFailure = -1;

/// What the properties of a file to be opened hold.
struct Target {
  MemoryImage* image;
};

/// What HDF5 holds of a file: its own part first.
struct MemoryFile {
  H5FD_t base;
  MemoryImage* image;
};

const MemoryFile* Get(const H5FD_t* file) { return reinterpret_cast<const MemoryFile*>(file); }

H5FD_t* Open(const char* /*name*/, unsigned /*flags*/, hid_t access, haddr_t /*max_address*/) noexcept {
  const void* const info = H5Pget_driver_info(access);
  if (info == nullptr) return nullptr;
  auto* const file = new (std::nothrow) MemoryFile{};
  if (file == nullptr) return nullptr;
  file->image = static_cast<const Target*>(info)->image;
  return &file->base;
}

herr_t Close(H5FD_t* file) noexcept {
  delete Get(file);
  return kSuccess;
}

haddr_t GetSize(const H5FD_t* file, H5FD_mem_t /*type*/) noexcept { return Get(file)->image->size(); }

herr_t SetSize(H5FD_t* file, H5FD_mem_t /*type*/, haddr_t size) noexcept {
  Get(file)->image->set_size(size);
  return kSuccess;
}

herr_t Read(H5FD_t* file, H5FD_mem_t /*type*/, hid_t /*transfer*/, haddr_t offset, size_t count,
            void* out) noexcept {
  Get(file)->image->Read(offset, count, static_cast<unsigned char*>(out));
  return kSuccess;
}

herr_t Write(H5FD_t* file, H5FD_mem_t /*type*/, hid_t /*transfer*/, haddr_t offset, size_t count,
             const void* bytes) noexcept {
  try {
    Get(file)->image->Write(offset, count, static_cast<const unsigned char*>(bytes));
    return kSuccess;
  } catch (const std::exception&) {
    return kFailure;  // exceptions must not pass through HDF5
  }
}

H5FD_class_t MakeClass() {
  H5FD_class_t driver{};
  driver.name = "dexcheck_memory";
  driver.maxaddr = static_cast<haddr_t>(std::numeric_limits<std::int64_t>::max());
  driver.fc_degree = H5F_CLOSE_STRONG;
  driver.fapl_size = sizeof(Target);
  driver.open = Open;
  driver.close = Close;
  driver.get_eoa = GetSize;
  driver.set_eoa = SetSize;
  driver.get_eof = GetSize;
  driver.read = Read;
  driver.write = Write;
  std::fill(std::begin(driver.fl_map), std::end(driver.fl_map), H5FD_MEM_DEFAULT);
  return driver;
}

/// Calls act(page number, begin within the page, begin within the range, count) for each page of a range.
template <typename Action>
void ForEachPage(std::uint64_t offset, size_t count, const Action& act) {
  for (size_t done = 0; done < count;) {
    const std::uint64_t at = offset + done;
    const auto begin = static_cast<size_t>(at % MemoryImage::kPageSize);
    const size_t part = std::min(MemoryImage::kPageSize - begin, count - done);
    act(at / MemoryImage::kPageSize, begin, done, part);
    done += part;
  }
}

}  // namespace

void MemoryImage::Read(std::uint64_t offset, size_t count, unsigned char* out) const {
  ForEachPage(offset, count, [&](std::uint64_t number, size_t begin, size_t done, size_t part) {
    const auto page = pages_.find(number);
    if (page == pages_.end()) {
      std::memset(out + done, 0, part);
    } else {
      std::memcpy(out + done, page->second.data() + begin, part);
    }
  });
}

void MemoryImage::Write(std::uint64_t offset, size_t count, const unsigned char* bytes) {
  ForEachPage(offset, count, [&](std::uint64_t number, size_t begin, size_t done, size_t part) {
    std::memcpy(pages_[number].data() + begin, bytes + done, part);
  });
}

Driver RegisterMemoryDriver() {
  static const H5FD_class_t driver = MakeClass();
  return Driver(H5FDregister(&driver));
}

void UseMemory(const Driver& driver, const Properties& access, MemoryImage* image) {
  const Target target{image};
  Check(H5Pset_driver(access.id(), driver.id(), &target));
}

}  // namespace dexcheck::hdf5
