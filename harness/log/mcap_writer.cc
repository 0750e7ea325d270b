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

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
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

/// Numbers and texts as the format writes them.
class Packer {
 public:
  template <typename Number>
  Packer& Add(Number number) {
    const auto chars = std::bit_cast<std::array<char, sizeof(Number)>>(number);
    bytes_.append(chars.data(), chars.size());
    return *this;
  }
  /// With its length before it.
  Packer& AddText(std::string_view text) {
    Add(static_cast<std::uint32_t>(text.size()));
    bytes_ += text;
    return *this;
  }
  Packer& AddBytes(std::string_view bytes) {
    bytes_ += bytes;
    return *this;
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

std::string MakeRecord(std::uint8_t opcode, std::string_view content) {
  return Packer().Add(opcode).Add(static_cast<std::uint64_t>(content.size())).AddBytes(content).bytes();
}

}  // namespace

McapWriter::McapWriter(const std::filesystem::path& path)
    : file_(path), stream_(file_.partial(), std::ios::binary) {
  if (!stream_) file_.Fail(std::strerror(errno));
  stream_ << kMagic;
  position_ = kMagic.size();
  WriteRecord(kHeader, Packer().AddText("").AddText("dexcheck").bytes());
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
    WriteRecord(kSchema, Packer()
                             .Add(schema)
                             .AddText(channel.schema_name)
                             .AddText("jsonschema")
                             .AddText(channel.schema)
                             .bytes());
    WriteRecord(kChannel, Packer()
                              .Add(static_cast<std::uint16_t>(i))
                              .Add(schema)
                              .AddText(channel.topic)
                              .AddText("json")
                              .AddText("")  // no metadata
                              .bytes());
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
  chunk_ += MakeRecord(kMessage, Packer()
                                     .Add(channel)
                                     .Add(channels_[channel].messages++)
                                     .Add(nanoseconds)
                                     .Add(nanoseconds)
                                     .AddBytes(json)
                                     .bytes());
  ++messages_;
  if (chunk_.size() >= kChunkSize) FlushChunk();
}

void McapWriter::FlushChunk() {
  if (chunk_.empty()) return;
  ChunkIndex index{chunk_first_, chunk_last_, position_, 0, 0, chunk_.size(), {}};
  WriteRecord(kChunk, Packer()
                          .Add(chunk_first_)
                          .Add(chunk_last_)
                          .Add(static_cast<std::uint64_t>(chunk_.size()))
                          .Add(std::uint32_t{0})  // no checksum
                          .AddText("")            // no compression
                          .Add(static_cast<std::uint64_t>(chunk_.size()))
                          .AddBytes(chunk_)
                          .bytes());
  index.length = position_ - index.start;
  const std::uint64_t before = position_;
  for (const auto& [channel, entries] : entries_) {
    index.message_indexes[channel] = position_;
    Packer pairs;
    for (const Entry& entry : entries) pairs.Add(entry.time).Add(entry.offset);
    WriteRecord(kMessageIndex, Packer().Add(channel).AddText(pairs.bytes()).bytes());
  }
  index.index_length = position_ - before;
  chunks_.push_back(index);
  chunk_.clear();
  entries_.clear();
}

void McapWriter::Finish() {
  if (!started_) WriteChannels();
  FlushChunk();
  WriteRecord(kDataEnd, Packer().Add(std::uint32_t{0}).bytes());
  const std::uint64_t summary = position_;
  WriteChannels();
  Packer counts;
  for (size_t i = 0; i < channels_.size(); ++i) {
    counts.Add(static_cast<std::uint16_t>(i)).Add(static_cast<std::uint64_t>(channels_[i].messages));
  }
  WriteRecord(kStatistics, Packer()
                               .Add(messages_)
                               .Add(static_cast<std::uint16_t>(channels_.size()))
                               .Add(static_cast<std::uint32_t>(channels_.size()))
                               .Add(std::uint32_t{0})  // attachments
                               .Add(std::uint32_t{0})  // metadata
                               .Add(static_cast<std::uint32_t>(chunks_.size()))
                               .Add(first_time_)
                               .Add(last_time_)
                               .AddText(counts.bytes())
                               .bytes());
  for (const ChunkIndex& chunk : chunks_) {
    Packer offsets;
    for (const auto& [channel, offset] : chunk.message_indexes) offsets.Add(channel).Add(offset);
    WriteRecord(kChunkIndex, Packer()
                                 .Add(chunk.first_time)
                                 .Add(chunk.last_time)
                                 .Add(chunk.start)
                                 .Add(chunk.length)
                                 .AddText(offsets.bytes())
                                 .Add(chunk.index_length)
                                 .AddText("")
                                 .Add(chunk.size)
                                 .Add(chunk.size)
                                 .bytes());
  }
  WriteRecord(kFooter, Packer().Add(summary).Add(std::uint64_t{0}).Add(std::uint32_t{0}).bytes());
  stream_ << kMagic;
  stream_.close();
  if (!stream_) file_.Fail(std::strerror(errno));
  file_.Commit();
}

}  // namespace dexcheck
