#include "harness/log/log_structure.h"

#include <algorithm>
#include <cstring>
#include <set>
#include <type_traits>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/log/log_file.h"

namespace dexcheck {
namespace {

class Packer {
 public:
  template <typename Number>
  void AddNumber(Number number) {
    static_assert(std::is_arithmetic_v<Number>);
    bytes_.append(reinterpret_cast<const char*>(&number), sizeof(number));
  }
  void Add(const std::string& text) {
    AddNumber(text.size());
    bytes_ += text;
  }
  void Add(const ByteRange& range) {
    AddNumber(range.begin);
    AddNumber(range.size);
  }
  void Add(const std::vector<StoredBytes>& parts) {
    AddNumber(parts.size());
    for (const auto& [name, range] : parts) {
      Add(name);
      Add(range);
    }
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

class Unpacker {
 public:
  explicit Unpacker(std::string_view bytes) : bytes_(bytes) {}

  template <typename Number>
  Number TakeNumber() {
    Number number{};
    std::memcpy(&number, Take(sizeof(number)).data(), sizeof(number));
    return number;
  }
  std::string TakeText() { return std::string(Take(TakeNumber<size_t>())); }
  ByteRange TakeRange() {
    const auto begin = TakeNumber<std::uint64_t>();
    return {begin, TakeNumber<std::uint64_t>()};
  }
  std::vector<StoredBytes> TakeParts() {
    std::vector<StoredBytes> parts;
    for (auto count = TakeNumber<size_t>(); count > 0; --count) {
      std::string name = TakeText();
      parts.emplace_back(std::move(name), TakeRange());
    }
    return parts;
  }
  void RequireEnd() const {
    if (!bytes_.empty()) Fail();
  }

 private:
  [[noreturn]] static void Fail() { throw InputError("its parts cannot be told"); }
  std::string_view Take(size_t count) {
    if (count > bytes_.size()) Fail();
    const std::string_view taken = bytes_.substr(0, count);
    bytes_.remove_prefix(count);
    return taken;
  }

  std::string_view bytes_;
};

void RequireWithin(const std::string& name, const ByteRange& range, std::uint64_t file_size) {
  if (range.size == 0) return;
  const bool is_within =
      range.begin >= kSealSize && range.begin <= file_size && range.size <= file_size - range.begin;
  if (!is_within) throw InputError(Quote(name) + " lies outside the file");
}

void CheckSignal(const StoredSignal& signal, std::uint64_t rows, std::uint64_t file_size) {
  const SignalInfo& info = signal.info;
  const std::string what = "signal " + Quote(info.name);
  if (!IsPlainPath(info.name)) throw InputError(what + ": must be a plain relative path");
  const std::uint64_t row_size = sizeof(double) * static_cast<std::uint64_t>(std::max(info.width, 0));
  const bool is_whole = info.width >= 1 && signal.rows == rows && signal.bytes.size % row_size == 0 &&
                        signal.bytes.size / row_size == rows;
  if (!is_whole) throw InputError(what + ": has not the rows that it must have");
  if (!info.columns.empty() && info.columns.size() != static_cast<size_t>(info.width)) {
    throw InputError(what + ": has not as many columns as numbers");
  }
  RequireWithin(info.name, signal.bytes, file_size);
}

void CheckFiles(const std::vector<StoredBytes>& files, std::uint64_t file_size) {
  std::set<std::string> names;
  for (const auto& [name, range] : files) {
    const std::string what = "embedded file " + Quote(name);
    if (!IsPlainPath(name)) {
      throw InputError(what + ": must be a plain relative path, without ., .. and backslashes");
    }
    if (!names.insert(name).second) throw InputError(what + ": is there twice");
    RequireWithin(name, range, file_size);
  }
  for (const std::string& name : names) {
    for (size_t end = name.find('/'); end != std::string::npos; end = name.find('/', end + 1)) {
      const std::string folder = name.substr(0, end);
      if (names.contains(folder)) throw InputError(Quote(folder) + " is an embedded file and a folder");
    }
  }
}

}  // namespace

void CheckStructure(const LogStructure& structure, std::uint64_t file_size) {
  if (structure.signals.empty()) throw InputError("it has no signals");
  const StoredSignal& time = structure.signals.front();
  if (time.info.width != 1) throw InputError(Quote(time.info.name) + " must have one number a row");
  std::set<std::string> names;
  for (const StoredSignal& signal : structure.signals) {
    CheckSignal(signal, time.rows, file_size);
    if (!names.insert(signal.info.name).second) {
      throw InputError("signal " + Quote(signal.info.name) + " is there twice");
    }
  }
  for (const auto& [name, range] : structure.reserved_texts) RequireWithin(name, range, file_size);
  CheckFiles(structure.files, file_size);
}

std::string PackStructure(const LogStructure& structure) {
  Packer packer;
  packer.AddNumber(structure.signals.size());
  for (const StoredSignal& signal : structure.signals) {
    packer.Add(signal.info.name);
    packer.Add(signal.info.unit);
    packer.Add(signal.info.description);
    packer.AddNumber(signal.info.width);
    packer.AddNumber(signal.info.columns.size());
    for (const std::string& column : signal.info.columns) packer.Add(column);
    packer.AddNumber(signal.info.attributes.size());
    for (const auto& [name, value] : signal.info.attributes) {
      packer.Add(name);
      packer.AddNumber(value);
    }
    packer.AddNumber(signal.rows);
    packer.Add(signal.bytes);
  }
  packer.AddNumber(structure.texts.size());
  for (const auto& [name, text] : structure.texts) {
    packer.Add(name);
    packer.Add(text);
  }
  packer.Add(structure.reserved_texts);
  packer.Add(structure.files);
  return packer.bytes();
}

LogStructure UnpackStructure(std::string_view bytes) {
  Unpacker unpacker(bytes);
  LogStructure structure;
  for (auto count = unpacker.TakeNumber<size_t>(); count > 0; --count) {
    StoredSignal& signal = structure.signals.emplace_back();
    signal.info.name = unpacker.TakeText();
    signal.info.unit = unpacker.TakeText();
    signal.info.description = unpacker.TakeText();
    signal.info.width = unpacker.TakeNumber<int>();
    for (auto left = unpacker.TakeNumber<size_t>(); left > 0; --left) {
      signal.info.columns.push_back(unpacker.TakeText());
    }
    for (auto left = unpacker.TakeNumber<size_t>(); left > 0; --left) {
      const std::string name = unpacker.TakeText();
      signal.info.attributes[name] = unpacker.TakeNumber<double>();
    }
    signal.rows = unpacker.TakeNumber<std::uint64_t>();
    signal.bytes = unpacker.TakeRange();
  }
  for (auto count = unpacker.TakeNumber<size_t>(); count > 0; --count) {
    const std::string name = unpacker.TakeText();
    structure.texts[name] = unpacker.TakeText();
  }
  structure.reserved_texts = unpacker.TakeParts();
  structure.files = unpacker.TakeParts();
  unpacker.RequireEnd();
  return structure;
}

}  // namespace dexcheck
