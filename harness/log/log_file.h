#pragma once

// The log as bytes in a file. HDF5 writes everything but the numbers once and closes the file; after that
// only these are written, in place, so that a process that dies cannot leave a file that HDF5 does not open.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "harness/base/files.h"
#include "harness/log/log_content.h"

namespace dexcheck {

/// @throws InputError "PATH: cannot be written: reason", the reason from the system's error number.
[[noreturn]] void FailToWrite(const std::filesystem::path& path, int error);
/// @throws InputError "PATH: cannot be read: reason".
[[noreturn]] void FailToRead(const std::filesystem::path& path, int error);

/// Writes all bytes at the offset. @throws InputError as FailToWrite of this name.
void WriteAt(const std::string& name, int descriptor, const void* bytes, size_t count, std::uint64_t offset);

/// Copies bytes between files. @throws InputError when that fails.
void CopyBytes(const std::string& name, int from, std::uint64_t from_offset, int to, std::uint64_t to_offset,
               size_t count);

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

}  // namespace dexcheck
