// Recordings of timed messages: MCAP (mcap.dev/spec) and ROS 2 bags (SQLite3 storage).

#include <SQLiteCpp/SQLiteCpp.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <deque>
#include <fstream>
#include <optional>
#include <set>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/bounded_json.h"
#include "harness/base/files.h"
#include "harness/log/recording_reader.h"

namespace dexcheck {
namespace {

using AnyJson = nlohmann::json;
constexpr double kNanoseconds = 1e-9;
constexpr size_t kMostFields = size_t{1} << 16U;      // numbers in a message
constexpr size_t kLongestMessage = size_t{1} << 24U;  // bytes of one that is read
constexpr const char* kJointState = "sensor_msgs/msg/JointState";

/// Takes numbers and texts from the front of bytes.
class ByteReader {
 public:
  ByteReader(std::string_view bytes, std::string where, bool is_swapped = false)
      : bytes_(bytes), where_(std::move(where)), is_swapped_(is_swapped) {}

  template <typename Number>
  Number Take() {
    const std::string_view raw = TakeBytes(sizeof(Number));
    std::array<char, sizeof(Number)> chars;
    std::copy(raw.begin(), raw.end(), chars.begin());
    if (is_swapped_) std::reverse(chars.begin(), chars.end());
    return std::bit_cast<Number>(chars);
  }
  std::string_view TakeBytes(std::uint64_t count) {
    if (count > bytes_.size() - at_) throw InputError(where_ + ": ends within its content");
    const std::string_view taken = bytes_.substr(at_, count);
    at_ += count;
    return taken;
  }
  std::string_view TakeText() { return TakeBytes(Take<std::uint32_t>()); }
  std::uint32_t TakeCount() { return Align(4), Take<std::uint32_t>(); }
  void Skip(std::uint64_t count) { TakeBytes(count); }
  /// To the next multiple, counted from where this began.
  void Align(size_t size) { Skip((size - at_ % size) % size); }
  [[nodiscard]] bool is_empty() const { return at_ == bytes_.size(); }

 private:
  std::string_view bytes_;
  std::string where_;
  bool is_swapped_;
  size_t at_ = 0;
};

constexpr const char* kFields[] = {"position", "velocity", "effort"};

/// Requires one number a joint in a field that is present.
void RequireCount(size_t count, size_t joints, const std::string& where, const char* field) {
  if (count != joints)
    throw InputError(where + ": " + field + ": must have " + std::to_string(joints) +
                     " numbers, one for each joint, got " + std::to_string(count));
}

void Flatten(const AnyJson& json, const std::string& name, TimedMessage* message) {
  if (json.is_number() && message->fields.size() <= kMostFields) {
    message->fields.emplace_back(name, json.get<double>());
  } else if (json.is_structured()) {
    size_t i = 0;
    for (const auto& [key, value] : json.items())
      Flatten(value, (name.empty() ? "" : name + ".") + (json.is_array() ? std::to_string(i++) : key),
              message);
  }
}

/// Reader of a message type; null for one that cannot be read.
using Parser = TimedMessage (*)(std::string_view data, double time, const std::string& where);

/// Rows of messages: those of one time are one row.
class MessageRecording : public RecordingReader {
 public:
  bool Next(std::vector<double>* row) override {
    if (!next_) return false;
    row->assign(names_.size(), kMissing);
    const double time = (*row)[0] = next_->time;
    while (next_ && next_->time == time) {
      for (const auto& [name, value] : next_->fields) {
        const auto place = columns_.find(name);
        if (place != columns_.end()) (*row)[place->second] = value;
      }
      Advance();
    }
    return true;
  }
  [[nodiscard]] std::string Where() const override {
    return source_ + ": message " + std::to_string(message_number_);
  }

 protected:
  explicit MessageRecording(std::string source) : source_(std::move(source)) { has_names_ = true; }

  /// The next message of the chosen topic.
  virtual std::optional<TimedMessage> ReadMessage() = 0;

  /// Reads as many messages as may be needed to see all fields; for the constructor's end.
  void ReadNames() {
    constexpr size_t kSeen = 64;
    names_ = {"time"};
    while (ahead_.size() < kSeen) {
      std::optional<TimedMessage> message = ReadMessage();
      if (!message) break;
      for (const auto& [name, value] : message->fields)
        if (columns_.emplace(name, names_.size()).second) names_.push_back(name);
      ahead_.push_back(std::move(*message));
    }
    if (ahead_.empty()) throw InputError(source_ + ": has no messages of joints");
    message_number_ = 0;
    Advance();
  }

  TimedMessage Parse(Parser parse, std::string_view data, double time) {
    ++message_number_;
    TimedMessage message;
    if (data.size() <= kLongestMessage) message = parse(data, time, Where());
    if (data.size() > kLongestMessage || message.fields.size() > kMostFields)
      throw InputError(Where() + ": is too large for a message of joints; choose a topic with --topic");
    return message;
  }

  std::string source_;
  long message_number_ = 0;  // of those that were read, counted by Parse

 private:
  void Advance() {
    if (ahead_.empty()) {
      next_ = ReadMessage();
      return;
    }
    next_ = std::move(ahead_.front());
    ahead_.pop_front();
    ++message_number_;
  }

  std::deque<TimedMessage> ahead_;
  std::optional<TimedMessage> next_;
  std::map<std::string, size_t> columns_;
};

Parser FindParser(const std::string& type, const std::string& encoding) {
  if (encoding == "json") return &ParseJsonMessage;
  if (encoding != "cdr" || (type != kJointState && type != "sensor_msgs/JointState")) return nullptr;
  return [](std::string_view data, double time, const std::string& where) {
    TimedMessage message = ParseJointState(data, where);
    if (message.time == 0.0) message.time = time;
    return message;
  };
}

[[noreturn]] void FailOnTopics(const std::string& source, const std::string& topic,
                               const std::set<std::string>& topics) {
  std::string list;
  for (const std::string& one : topics) list += (list.empty() ? "" : ", ") + one;
  const std::string what = topic.empty() ? std::string("of joints (") + kJointState + ", or messages in JSON)"
                                         : Quote(topic) + " that can be read";
  throw InputError(source + ": has no topic " + what + "; it has " + (list.empty() ? "none" : list));
}

class McapRecording : public MessageRecording {
 public:
  McapRecording(const std::filesystem::path& path, std::string topic)
      : MessageRecording(path.string()),
        topic_(std::move(topic)),
        file_(path, std::ios::binary),
        size_(SizeOf(path)) {
    file_.seekg(8);
    ReadNames();
    format_ = topic_.empty() ? "MCAP, all topics" : "MCAP, topic " + topic_;
  }

 protected:
  std::optional<TimedMessage> ReadMessage() override {
    std::optional<TimedMessage> message;
    while (!message) {
      while (chunk_.is_empty())
        if (!ReadRecord()) return std::nullopt;
      const auto opcode = chunk_.Take<std::uint8_t>();
      message = Handle(opcode, chunk_.TakeBytes(chunk_.Take<std::uint64_t>()));
    }
    return message;
  }

 private:
  [[noreturn]] void Fail(const std::string& problem) const { throw InputError(source_ + ": " + problem); }

  /// The file's next record becomes what is read.
  bool ReadRecord() {
    char head[9];
    if (has_ended_ || !file_.read(head, sizeof head)) {
      if (channels_.empty() || (!topic_.empty() && !seen_.contains(topic_)))
        FailOnTopics(source_, topic_, seen_);
      return false;
    }
    const auto length = ByteReader({head + 1, 8}, source_).Take<std::uint64_t>();
    if (length > size_) Fail("ends within a record, of " + std::to_string(length) + " bytes");
    record_.assign(head, sizeof head);
    record_.resize(sizeof head + length);
    if (!file_.read(record_.data() + sizeof head, static_cast<std::streamsize>(length)))
      Fail("ends within a record");
    constexpr char kDataEnd = 0x0F, kChunk = 0x06;
    has_ended_ = head[0] == kDataEnd;
    chunk_ = ByteReader(record_, source_);
    if (head[0] == kChunk) OpenChunk();
    return true;
  }

  void OpenChunk() {
    ByteReader reader(std::string_view(record_).substr(9), source_);
    reader.Skip(16);
    const auto size = reader.Take<std::uint64_t>();
    reader.Skip(4);
    const std::string compression(reader.TakeText());
    const std::string_view data = reader.TakeBytes(reader.Take<std::uint64_t>());
    if (size > MostUnpacked(data.size())) Fail("has a chunk of " + std::to_string(size) + " bytes");
    content_.resize(size);
    if (!compression.empty() && compression != "zstd" && compression != "lz4")
      Fail("has a chunk with compression " + Quote(compression) + "; known are lz4 and zstd");
    if (compression.empty()) {
      content_ = data;
    } else if (compression == "lz4"
                   ? !DecompressLz4(data)
                   : ZSTD_decompress(content_.data(), size, data.data(), data.size()) != size) {
      Fail("has a chunk that cannot be decompressed (" + compression + ")");
    }
    chunk_ = ByteReader(content_, source_);
  }

  bool DecompressLz4(std::string_view data) {
    LZ4F_dctx* context = nullptr;
    if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0) return false;
    size_t out = content_.size(), in = data.size();
    const size_t missing = LZ4F_decompress(context, content_.data(), &out, data.data(), &in, nullptr);
    LZ4F_freeDecompressionContext(context);
    return missing == 0 && out == content_.size();
  }

  std::optional<TimedMessage> Handle(std::uint8_t opcode, std::string_view content) {
    constexpr std::uint8_t kSchema = 3, kChannel = 4, kMessage = 5;
    ByteReader reader(content, source_);
    if (opcode == kSchema) {
      const auto id = reader.Take<std::uint16_t>();
      schemas_[id] = reader.TakeText();
    } else if (opcode == kChannel) {
      const auto id = reader.Take<std::uint16_t>();
      const auto schema = reader.Take<std::uint16_t>();
      const std::string topic(reader.TakeText());
      const std::string encoding(reader.TakeText());
      seen_.insert(topic);
      if (const Parser parse = FindParser(schemas_[schema], encoding)) channels_[id] = {topic, parse};
      if (topic_.empty() && encoding == "cdr" && channels_.contains(id)) topic_ = topic;
    } else if (opcode == kMessage) {
      const auto channel = channels_.find(reader.Take<std::uint16_t>());
      if (channel == channels_.end()) return std::nullopt;
      const auto& [topic, parse] = channel->second;
      if (!topic_.empty() && topic != topic_) return std::nullopt;
      reader.Skip(4);
      const double time = kNanoseconds * static_cast<double>(reader.Take<std::uint64_t>());
      reader.Skip(8);
      TimedMessage message = Parse(parse, content.substr(22), time);
      // With several topics, each field is prefixed by its topic.
      if (topic_.empty())
        for (auto& field : message.fields) field.first = topic + "." + field.first;
      return message;
    }
    return std::nullopt;
  }

  std::string topic_;
  std::ifstream file_;
  std::uintmax_t size_;  // of the file, in bytes
  std::string record_, content_;
  ByteReader chunk_{{}, ""};
  std::map<std::uint16_t, std::string> schemas_;
  std::map<std::uint16_t, std::pair<std::string, Parser>> channels_;  // topic
  std::set<std::string> seen_;
  bool has_ended_ = false;
};

class BagRecording : public MessageRecording {
 public:
  BagRecording(const std::filesystem::path& path, std::string topic) : MessageRecording(path.string()) {
    try {
      database_.emplace(path.string(), SQLite::OPEN_READONLY);
      Choose(&topic);
    } catch (const SQLite::Exception& error) {
      throw InputError(source_ + ": is no ROS 2 bag: " + error.what());
    }
    ReadNames();
    format_ = "ROS 2 bag, topic " + topic;
  }

 protected:
  std::optional<TimedMessage> ReadMessage() override {
    try {
      has_ended_ = has_ended_ || !messages_->executeStep();
      if (has_ended_) return std::nullopt;
      const SQLite::Column data = messages_->getColumn(1);
      const double time = kNanoseconds * static_cast<double>(messages_->getColumn(0).getInt64());
      return Parse(parse_, {static_cast<const char*>(data.getBlob()), static_cast<size_t>(data.getBytes())},
                   time);
    } catch (const SQLite::Exception& error) {
      throw InputError(Where() + ": cannot be read: " + error.what());
    }
  }

 private:
  void Choose(std::string* topic) {
    SQLite::Statement topics(*database_, "SELECT id, name, type, serialization_format FROM topics");
    std::set<std::string> seen;
    std::int64_t id = -1;
    while (topics.executeStep()) {
      const std::string name = topics.getColumn(1).getString();
      seen.insert(name);
      const Parser parse = FindParser(topics.getColumn(2).getString(), topics.getColumn(3).getString());
      if (parse == nullptr || id >= 0 || !(topic->empty() || *topic == name)) continue;
      id = topics.getColumn(0).getInt64();
      parse_ = parse;
      *topic = name;
    }
    if (id < 0) FailOnTopics(source_, *topic, seen);
    messages_.emplace(*database_,
                      "SELECT timestamp, data FROM messages WHERE topic_id = ? ORDER BY timestamp, id");
    messages_->bind(1, id);
  }

  std::optional<SQLite::Database> database_;
  std::optional<SQLite::Statement> messages_;
  Parser parse_ = nullptr;
  bool has_ended_ = false;
};

}  // namespace

TimedMessage ParseJointState(std::string_view cdr, const std::string& where) {
  if (cdr.size() < 4 || cdr[0] != 0 || (cdr[1] & ~1) != 0)
    throw InputError(where + ": is no " + kJointState + " in plain CDR");
  ByteReader reader(cdr.substr(4), where, cdr[1] == 0);
  TimedMessage message;
  const auto seconds = reader.Take<std::int32_t>();
  message.time = seconds + kNanoseconds * reader.Take<std::uint32_t>();
  reader.Skip(reader.TakeCount());
  std::vector<std::string> joints;
  for (std::uint32_t n = reader.TakeCount(), i = 0; i < n; ++i) {
    const std::string_view text = reader.TakeBytes(reader.TakeCount());
    joints.emplace_back(text.substr(0, text.find('\0')));
  }
  for (const char* field : kFields) {
    const std::uint32_t n = reader.TakeCount();
    if (n == 0) continue;
    RequireCount(n, joints.size(), where, field);
    reader.Align(8);
    for (const std::string& joint : joints)
      message.fields.emplace_back(std::string(field) + "." + joint, reader.Take<double>());
  }
  return message;
}

TimedMessage ParseJsonMessage(std::string_view text, double time, const std::string& where) {
  const AnyJson json = ParseJson(text);
  if (!json.is_object())
    throw InputError(where + ": must be an object in JSON, of at most 32 brackets inside each other");
  TimedMessage message{.time = time};
  const bool is_joint_state = json.contains("name") && json["name"].is_array() && json.contains("position");
  if (!is_joint_state) return Flatten(json, "", &message), message;
  const AnyJson& joints = json["name"];
  for (const char* field : kFields) {
    const AnyJson values = json.value(field, AnyJson::array());
    if (values.empty()) continue;
    RequireCount(values.size(), joints.size(), where, field);
    for (size_t i = 0; i < joints.size(); ++i) {
      if (!values.is_array() || !values[i].is_number() || !joints[i].is_string())
        throw InputError(where + ": " + field + ": must be numbers by joint");
      message.fields.emplace_back(std::string(field) + "." + joints[i].get<std::string>(),
                                  values[i].get<double>());
    }
  }
  const auto read = [&](const char* key) {
    const AnyJson::json_pointer place(std::string("/header/stamp/") + key);
    return json.contains(place) && json[place].is_number() ? json[place].get<double>() : 0.0;
  };
  const double seconds = read("sec") + kNanoseconds * (read("nanosec") + read("nsec"));
  if (seconds > 0.0) message.time = seconds;
  return message;
}

std::unique_ptr<RecordingReader> OpenMcapRecording(const std::filesystem::path& path,
                                                   const std::string& topic) {
  return std::make_unique<McapRecording>(path, topic);
}

std::unique_ptr<RecordingReader> OpenBagRecording(const std::filesystem::path& path,
                                                  const std::string& topic) {
  return std::make_unique<BagRecording>(path, topic);
}

}  // namespace dexcheck
