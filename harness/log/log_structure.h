#pragma once

// Where the parts of a log lie. HDF5 1.10 can crash on, or loop over, a file whose structure was forged
// together with its checksum. So a process of its own walks the structure and tells what it found; this one
// checks what it was told, and reads numbers, files and late texts itself, at places that lie within the
// file.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
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

/// Walks the structure with HDF5, in this process. For trusted files, and for the process that may crash.
/// @param descriptor of the open log.
/// @throws std::exception whose text says what is wrong.
LogStructure WalkStructure(int descriptor);

/// Walks it in a process of its own, with limits on its time and memory, and checks what it tells.
/// @param path for messages.
/// @throws InputError "PATH: the log is damaged: ...", also when that process crashes.
LogStructure ReadStructure(int descriptor, const std::filesystem::path& path);

/// @throws InputError unless all parts lie within a file of this size, behind the seal, and all names are
/// plain and do not collide.
void CheckStructure(const LogStructure& structure, std::uint64_t file_size);

/// As bytes between two processes of one program.
std::string PackStructure(const LogStructure& structure);
/// @throws InputError when these are no such bytes.
LogStructure UnpackStructure(std::string_view bytes);

}  // namespace dexcheck
