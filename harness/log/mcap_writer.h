#pragma once

// A file of timed messages that Foxglove, PlotJuggler and others read: MCAP (mcap.dev/spec), with messages as
// JSON.

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "harness/base/files.h"

namespace dexcheck {

/// Writes one file, in chunks with an index, without compression. Nothing stands under its name before
/// Finish.
class McapWriter {
 public:
  /// @throws InputError "PATH: cannot be written: reason".
  explicit McapWriter(const std::filesystem::path& path);

  /// Before the first message. @param schema of the messages, JSON Schema. @returns its number.
  std::uint16_t AddChannel(const std::string& topic, const std::string& schema_name,
                           const std::string& schema);
  /// @param time s, at least 0; @param json one object.
  void Write(std::uint16_t channel, double time, std::string_view json);
  /// @throws InputError when the file cannot be written.
  void Finish();

 private:
  struct Channel {
    std::string topic, schema_name, schema;
    std::uint32_t messages = 0;
  };
  /// Location and extent of a chunk.
  struct ChunkIndex {
    std::uint64_t first_time, last_time, start, length, index_length, size;
    std::map<std::uint16_t, std::uint64_t> message_indexes;  ///< Where each channel's is.
  };
  struct Entry {
    std::uint64_t time, offset;
  };

  void WriteRecord(std::uint8_t opcode, std::string_view content);
  void WriteChannels();
  void FlushChunk();

  PartialFile file_;
  std::ofstream stream_;
  std::uint64_t position_ = 0;
  std::vector<Channel> channels_;
  bool started_ = false;
  std::string chunk_;
  std::map<std::uint16_t, std::vector<Entry>> entries_;  // of the chunk
  std::uint64_t chunk_first_ = 0, chunk_last_ = 0;
  std::vector<ChunkIndex> chunks_;
  std::uint64_t first_time_ = 0, last_time_ = 0, messages_ = 0;
};

}  // namespace dexcheck
