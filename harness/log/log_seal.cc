#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>
#include <string_view>

#include "controller/common/errors.h"
#include "harness/log/log_file.h"

namespace dexcheck {
namespace {

constexpr char kSealFormat[] = "dexcheck log 1\nbytes %llu\nvariable %llu %llu\ncrc32 %08lx\n";
constexpr std::string_view kSealBegin = "dexcheck log ";
constexpr std::string_view kThisVersion = "dexcheck log 1\n";
constexpr size_t kChunk = size_t{1} << 16;

using Seal = std::array<char, kSealSize>;

/// The seal's text; the rest is zeros.
Seal MakeSeal(std::uint64_t size, std::uint64_t begin, std::uint64_t end, uLong checksum) {
  Seal seal{};
  std::snprintf(seal.data(), seal.size(), kSealFormat, static_cast<unsigned long long>(size),
                static_cast<unsigned long long>(begin), static_cast<unsigned long long>(end), checksum);
  return seal;
}

/// Reads until `count` bytes or the file's end. @return how many were read, or nothing after an error.
std::optional<size_t> ReadAt(int descriptor, void* bytes, size_t count, std::uint64_t offset) {
  size_t done = 0;
  while (done < count) {
    const ssize_t step = ::pread(descriptor, static_cast<char*>(bytes) + done, count - done,
                                 static_cast<off_t>(offset + done));
    if (step < 0 && errno == EINTR) continue;
    if (step < 0) return std::nullopt;
    if (step == 0) break;
    done += static_cast<size_t>(step);
  }
  return done;
}

/// Continues the checksum over [begin, end). @return nothing when the bytes cannot be read.
std::optional<uLong> AddToChecksum(uLong checksum, int descriptor, std::uint64_t begin, std::uint64_t end) {
  std::array<unsigned char, kChunk> chunk;
  for (std::uint64_t at = begin; at < end;) {
    const auto count = static_cast<size_t>(std::min<std::uint64_t>(kChunk, end - at));
    const std::optional<size_t> read = ReadAt(descriptor, chunk.data(), count, at);
    if (!read) return std::nullopt;
    if (*read != count) {
      errno = EIO;
      return std::nullopt;
    }
    checksum = ::crc32(checksum, chunk.data(), static_cast<uInt>(count));
    at += count;
  }
  return checksum;
}

/// Of everything between the seal and the file's end but the variable part.
std::optional<uLong> CalcChecksum(int descriptor, std::uint64_t begin, std::uint64_t end,
                                  std::uint64_t size) {
  const std::optional<uLong> head = AddToChecksum(0, descriptor, kSealSize, begin);
  return head ? AddToChecksum(*head, descriptor, end, size) : head;
}

}  // namespace

int WriteSeal(int descriptor, std::uint64_t begin, std::uint64_t end) {
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) return errno;
  const auto size = static_cast<std::uint64_t>(status.st_size);
  const std::optional<uLong> checksum = CalcChecksum(descriptor, begin, end, size);
  if (!checksum) return errno;
  const Seal seal = MakeSeal(size, begin, end, *checksum);
  return WriteAt(descriptor, seal.data(), seal.size(), 0);
}

void CheckSeal(int descriptor, const std::filesystem::path& path) {
  const auto fail = [&](const std::string& problem) { throw InputError(path.string() + ": " + problem); };
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) FailToRead(path, errno);
  if (S_ISDIR(status.st_mode)) FailToRead(path, EISDIR);
  if (!S_ISREG(status.st_mode)) fail("not a dexcheck log: not a regular file");
  if (status.st_size == 0) fail("not a dexcheck log: the file is empty");
  Seal seal{};
  const std::optional<size_t> read = ReadAt(descriptor, seal.data(), seal.size(), 0);
  if (!read) FailToRead(path, errno);
  const std::string_view text(seal.data(), *read);
  if (!text.starts_with(kSealBegin)) fail("not a dexcheck log");
  if (*read < kSealSize) fail("the log is cut short: " + std::to_string(*read) + " bytes");
  if (!text.starts_with(kThisVersion)) fail("written by another version of dexcheck, or damaged");

  unsigned long long size = 0;
  unsigned long long begin = 0;
  unsigned long long end = 0;
  uLong checksum = 0;
  const std::string lines(text.substr(0, kSealSize - 1));
  const int found = std::sscanf(lines.c_str(), kSealFormat, &size, &begin, &end, &checksum);
  if (found != 4 || seal != MakeSeal(size, begin, end, checksum) || begin < kSealSize || end < begin ||
      size < end) {
    fail("the log's first 512 bytes are damaged");
  }
  const auto actual = static_cast<unsigned long long>(status.st_size);
  if (actual < size) {
    fail("the log is cut short: " + std::to_string(actual) + " of " + std::to_string(size) + " bytes");
  }
  const std::optional<uLong> actual_checksum = CalcChecksum(descriptor, begin, end, size);
  if (!actual_checksum) FailToRead(path, errno);
  if (*actual_checksum != checksum) fail("the log is damaged, or was changed: its checksum is wrong");
}

}  // namespace dexcheck
