#include "harness/log/mcap_writer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>

namespace dexcheck {
namespace {

static_assert(std::endian::native == std::endian::little, "the format's order");

constexpr std::string_view kMcapMagic("\x89MCAP0\r\n", 8);
constexpr size_t kChunkSize = size_t{1} << 20;

enum Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kDataEnd = 0x0F,
};

/// Bytes that stand as they are, without their length.
struct Raw {
  std::string_view bytes;
};

template <typename Number>
void Append(Number number, std::string* bytes) {
  const auto chars = std::bit_cast<std::array<char, sizeof(Number)>>(number);
  bytes->append(chars.data(), chars.size());
}
void Append(std::string_view text, std::string* bytes) {
  Append(static_cast<std::uint32_t>(text.size()), bytes);
  *bytes += text;
}
void Append(const std::string& text, std::string* bytes) { Append(std::string_view(text), bytes); }
void Append(const char* text, std::string* bytes) { Append(std::string_view(text), bytes); }
void Append(const Raw& raw, std::string* bytes) { *bytes += raw.bytes; }

/// Numbers, and texts with their lengths before them, as the format writes them.
template <typename... Parts>
std::string Pack(const Parts&... parts) {
  std::string bytes;
  (Append(parts, &bytes), ...);
  return bytes;
}

std::string MakeRecord(std::uint8_t opcode, std::string_view content) {
  return Pack(opcode, std::uint64_t{content.size()}, Raw{content});
}

constexpr std::uint32_t kNone = 0;  // checksums, attachments, metadata

}  // namespace

McapWriter::McapWriter(const std::filesystem::path& path)
    : file_(path), stream_(file_.partial(), std::ios::binary) {
  if (!stream_) file_.Fail(std::strerror(errno));
  stream_ << kMcapMagic;
  position_ = kMcapMagic.size();
  WriteRecord(kHeader, Pack("", "dexcheck"));
}

void McapWriter::WriteRecord(std::uint8_t opcode, std::string_view content) {
  const std::string record = MakeRecord(opcode, content);
  stream_ << record;
  position_ += record.size();
}

std::uint16_t McapWriter::AddChannel(const std::string& topic, const std::string& schema_name,
                                     const std::string& schema) {
  channels_.push_back({topic, schema_name, schema});
  return static_cast<std::uint16_t>(channels_.size() - 1);
}

void McapWriter::WriteChannels() {
  for (size_t i = 0; i < channels_.size(); ++i) {
    const Channel& channel = channels_[i];
    const auto schema = static_cast<std::uint16_t>(i + 1);  // 0 means none
    WriteRecord(kSchema, Pack(schema, channel.schema_name, "jsonschema", channel.schema));
    WriteRecord(kChannel, Pack(static_cast<std::uint16_t>(i), schema, channel.topic, "json", kNone));
  }
}

void McapWriter::Write(std::uint16_t channel, double time, std::string_view json) {
  if (!started_) WriteChannels();
  started_ = true;
  const auto nanoseconds = static_cast<std::uint64_t>(std::llround(1e9 * std::max(time, 0.0)));
  if (chunk_.empty()) chunk_first_ = nanoseconds;
  if (messages_ == 0) first_time_ = nanoseconds;
  chunk_last_ = last_time_ = nanoseconds;
  entries_[channel].push_back({nanoseconds, chunk_.size()});
  chunk_ +=
      MakeRecord(kMessage, Pack(channel, channels_[channel].messages++, nanoseconds, nanoseconds, Raw{json}));
  ++messages_;
  if (chunk_.size() >= kChunkSize) FlushChunk();
}

void McapWriter::FlushChunk() {
  if (chunk_.empty()) return;
  ChunkIndex index{chunk_first_, chunk_last_, position_, 0, 0, chunk_.size(), {}};
  const std::uint64_t size = chunk_.size();
  WriteRecord(kChunk, Pack(chunk_first_, chunk_last_, size, kNone, "", size, Raw{chunk_}));
  index.length = position_ - index.start;
  const std::uint64_t before = position_;
  for (const auto& [channel, entries] : entries_) {
    index.message_indexes[channel] = position_;
    std::string pairs;
    for (const Entry& entry : entries) pairs += Pack(entry.time, entry.offset);
    WriteRecord(kMessageIndex, Pack(channel, pairs));
  }
  index.index_length = position_ - before;
  chunks_.push_back(index);
  chunk_.clear();
  entries_.clear();
}

void McapWriter::Finish() {
  if (!started_) WriteChannels();
  FlushChunk();
  WriteRecord(kDataEnd, Pack(kNone));
  const std::uint64_t summary = position_;
  WriteChannels();
  std::string counts;
  for (size_t i = 0; i < channels_.size(); ++i) {
    counts += Pack(static_cast<std::uint16_t>(i), std::uint64_t{channels_[i].messages});
  }
  const auto channels = static_cast<std::uint16_t>(channels_.size());
  WriteRecord(kStatistics, Pack(messages_, channels, std::uint32_t{channels}, kNone, kNone,
                                static_cast<std::uint32_t>(chunks_.size()), first_time_, last_time_, counts));
  for (const ChunkIndex& chunk : chunks_) {
    std::string offsets;
    for (const auto& [channel, offset] : chunk.message_indexes) offsets += Pack(channel, offset);
    WriteRecord(kChunkIndex, Pack(chunk.first_time, chunk.last_time, chunk.start, chunk.length, offsets,
                                  chunk.index_length, "", chunk.size, chunk.size));
  }
  WriteRecord(kFooter, Pack(summary, std::uint64_t{0}, kNone));
  stream_ << kMcapMagic;
  stream_.close();
  if (!stream_) file_.Fail(std::strerror(errno));
  file_.Commit();
}

}  // namespace dexcheck
