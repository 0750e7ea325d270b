#include "harness/log/log_reader.h"

#include <fcntl.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/log/extract_file.h"

namespace dexcheck {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are read as they lie in the file");

FileDescriptor Open(const std::filesystem::path& path) {
  // Non-blocking, for the sake of pipes; it changes nothing for files.
  FileDescriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
  if (!file.is_open()) FailToRead(path, errno);
  CheckSeal(file.get(), path);
  return file;
}

/// The part of that name, or null.
const ByteRange* Find(const std::vector<StoredBytes>& parts, const std::string& name) {
  const auto part = std::find_if(parts.begin(), parts.end(),
                                 [&](const StoredBytes& stored) { return stored.first == name; });
  return part == parts.end() ? nullptr : &part->second;
}

[[noreturn]] void FailToFind(const std::filesystem::path& path, const std::string& kind,
                             const std::string& name, const std::vector<std::string>& known) {
  const std::string nearest = FindNearest(name, known);
  throw InputError(path.string() + ": no " + kind + " " + Quote(name) +
                   (nearest.empty() ? "" : ", did you mean " + Quote(nearest) + "?"));
}

}  // namespace

LogReader::LogReader(const std::filesystem::path& path)
    : path_(path), file_(Open(path)), structure_(ReadStructure(file_.get(), path)) {
  for (const StoredSignal& signal : structure_.signals) signals_.push_back(signal.info);
  CountRows();
}

void LogReader::Read(std::uint64_t begin, size_t count, void* out) const {
  if (const int error = ReadExactly(file_.get(), out, count, begin); error != 0) FailToRead(path_, error);
}

std::string LogReader::ReadRange(const ByteRange& range) const {
  std::string bytes(range.size, '\0');
  Read(range.begin, bytes.size(), bytes.data());
  return bytes;
}

void LogReader::CountRows() {
  const StoredSignal& time = structure_.signals.front();
  std::vector<double> times(time.rows);
  Read(time.bytes.begin, time.bytes.size, times.data());
  const auto is_unwritten = [](double value) { return std::isnan(value); };
  rows_ = static_cast<long>(std::find_if(times.begin(), times.end(), is_unwritten) - times.begin());
}

RowMatrixXd LogReader::ReadSignal(const std::string& name) const {
  const auto is_wanted = [&](const StoredSignal& signal) { return signal.info.name == name; };
  const auto signal = std::find_if(structure_.signals.begin(), structure_.signals.end(), is_wanted);
  if (signal == structure_.signals.end()) {
    std::vector<std::string> known;
    for (const SignalInfo& other : signals_) known.push_back(other.name);
    FailToFind(path_, "signal", name, known);
  }
  RowMatrixXd rows(rows_, signal->info.width);
  Read(signal->bytes.begin, sizeof(double) * static_cast<size_t>(rows.size()), rows.data());
  return rows;
}

std::vector<std::string> LogReader::ListTexts() const {
  std::vector<std::string> names;
  for (const auto& [name, text] : structure_.texts) names.push_back(name);
  for (const auto& [name, range] : structure_.reserved_texts) names.push_back(name);
  std::sort(names.begin(), names.end());
  return names;
}

std::string LogReader::ReadText(const std::string& name) const {
  if (const auto text = structure_.texts.find(name); text != structure_.texts.end()) return text->second;
  const ByteRange* const range = Find(structure_.reserved_texts, name);
  if (range == nullptr) FailToFind(path_, "text", name, ListTexts());
  const std::string text = ReadRange(*range);
  return text.substr(0, text.find('\0'));
}

std::string LogReader::FindText(const std::string& name) const {
  const bool has = structure_.texts.count(name) != 0 || Find(structure_.reserved_texts, name) != nullptr;
  return has ? ReadText(name) : "";
}

std::vector<std::string> LogReader::ListFiles(const std::string& group) const {
  const std::string prefix = group + "/";
  std::vector<std::string> names;
  for (const auto& [name, range] : structure_.files) {
    if (name.starts_with(prefix)) names.push_back(name.substr(prefix.size()));
  }
  if (names.empty()) FailToFind(path_, "group of files", group, {});
  std::sort(names.begin(), names.end());
  return names;
}

std::string LogReader::ReadFile(const std::string& group, const std::string& relative_name) const {
  const std::string name = group + "/" + relative_name;
  const ByteRange* const range = Find(structure_.files, name);
  if (range == nullptr) FailToFind(path_, "embedded file", name, {});
  return ReadRange(*range);
}

void LogReader::ExtractFiles(const std::string& group, const std::filesystem::path& folder) const {
  for (const std::string& name : ListFiles(group)) ExtractFile(folder, name, ReadFile(group, name));
}

}  // namespace dexcheck
