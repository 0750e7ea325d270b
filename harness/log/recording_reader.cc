#include "harness/log/recording_reader.h"

#include <fstream>
#include <limits>

#include "controller/common/errors.h"

namespace dexcheck {
namespace {

namespace fs = std::filesystem;

/// The file of a bag's folder that has its messages.
fs::path FindBagFile(const fs::path& folder) {
  fs::path found;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const fs::path extension = entry.path().extension();
    if (extension != ".db3" && extension != ".mcap" && entry.path().filename() != "log.h5") continue;
    if (!found.empty()) throw InputError(folder.string() + ": has several recordings; name one of its files");
    found = entry.path();
  }
  if (found.empty()) throw InputError(folder.string() + ": has no recording (.db3, .mcap or log.h5)");
  return found;
}

std::string ReadBeginning(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw InputError(path.string() + ": cannot be read");
  std::string begin(16, '\0');
  stream.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<size_t>(stream.gcount()));
  return begin;
}

}  // namespace

std::unique_ptr<RecordingReader> OpenRecording(const fs::path& path, const std::string& topic, size_t width) {
  if (path == "-") return OpenTextRecording(path, width);
  if (fs::is_directory(path)) return OpenRecording(FindBagFile(path), topic, width);
  const std::string begin = ReadBeginning(path);
  if (begin.empty()) throw InputError(path.string() + ": is empty");
  if (begin.starts_with("\x89MCAP")) return OpenMcapRecording(path, topic);
  if (begin.starts_with("SQLite format 3")) return OpenBagRecording(path, topic);
  if (begin.starts_with("\x93NUMPY") || begin.starts_with("PK\x03\x04")) return OpenNumpyRecording(path);
  if (begin.starts_with("\x89HDF\r\n")) return OpenHdf5Recording(path);
  return OpenTextRecording(path, width);
}

TableReader::TableReader(std::string source, std::string format, std::vector<std::string> names,
                         std::vector<std::vector<double>> columns)
    : source_(std::move(source)), columns_(std::move(columns)) {
  names_ = std::move(names);
  format_ = std::move(format);
  has_names_ = true;
}

bool TableReader::Next(std::vector<double>* row) {
  if (columns_.empty() || row_ >= columns_.front().size()) return false;
  row->resize(columns_.size());
  for (size_t i = 0; i < columns_.size(); ++i) (*row)[i] = columns_[i][row_];
  ++row_;
  return true;
}

std::string TableReader::Where() const { return source_ + ": row " + std::to_string(row_); }

}  // namespace dexcheck
