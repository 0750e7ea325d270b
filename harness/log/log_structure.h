#pragma once

// Where the parts of a log lie. The seal's checksum has told that they lie where LogWriter put them, before
// HDF5 1.10, which can crash on a damaged structure, sees the file.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "harness/log/log_content.h"

namespace dexcheck {

/// Bytes of the log's file.
struct ByteRange {
  std::uint64_t begin = 0;
  std::uint64_t size = 0;
};

/// One recorded quantity and its rows, of info.width doubles each, one behind the other.
struct StoredSignal {
  SignalInfo info;
  std::uint64_t rows = 0;  ///< Room for rows, written or not.
  ByteRange bytes;
};

/// A file or a text that lies in the log's file as it is.
using StoredBytes = std::pair<std::string, ByteRange>;

struct LogStructure {
  std::vector<StoredSignal> signals;         ///< In the order in which they were added; the first is time.
  std::map<std::string, std::string> texts;  ///< Those that were known when the log was begun or closed.
  std::vector<StoredBytes> reserved_texts;   ///< Up to their first zero byte.
  std::vector<StoredBytes> files;            ///< By path: "inputs/scenario.toml".
};

/// Walks the structure with HDF5.
/// @param descriptor of the open log, whose seal was checked.
/// @param path for messages.
/// @throws InputError "PATH: the log is damaged: ...", also of names that lead out of a folder.
LogStructure ReadStructure(int descriptor, const std::filesystem::path& path);

}  // namespace dexcheck
