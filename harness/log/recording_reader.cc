#include "harness/log/recording_reader.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iostream>
#include <optional>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/files.h"

namespace dexcheck {

namespace {

namespace fs = std::filesystem;

/// The file of a bag's folder that has its messages.
fs::path FindBagFile(const fs::path& folder) {
  fs::path found;
  for (const fs::path& path : ListFolder(folder)) {
    const fs::path extension = path.extension();
    if (extension != ".db3" && extension != ".mcap" && path.filename() != "log.h5") continue;
    if (!found.empty()) throw InputError(folder.string() + ": has several recordings; name one of its files");
    found = path;
  }
  if (found.empty()) throw InputError(folder.string() + ": has no recording (.db3, .mcap or log.h5)");
  return found;
}

std::string ReadBeginning(const fs::path& path) {
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw InputError(path.string() + ": cannot be read: " + std::strerror(errno));
  std::string begin(16, '\0');
  stream.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<size_t>(stream.gcount()));
  return begin;
}

constexpr size_t kLongestLine = size_t{1} << 20U;

std::string_view WithoutQuotes(std::string_view cell) { return Trim(cell, " \t\r\"'"); }

/// Also of one with a plus, or in quotes.
std::optional<double> ParseCell(std::string_view text) {
  text = WithoutQuotes(text);
  return ParseNumber<double>(text.starts_with('+') ? text.substr(1) : text);
}

/// The text outside of quotes, which open where a cell begins and are doubled inside (RFC 4180).
/// @param is_open whether the text ends inside of quotes.
std::string ListUnquoted(std::string_view text, bool* is_open) {
  std::string outside;
  bool begins = true;
  *is_open = false;
  for (const char c : text) {
    const bool turns = c == '"' && (*is_open || begins);
    begins = *is_open ? turns : c == ',' || c == ';' || c == '\t';
    if (turns) *is_open = !*is_open;
    if (!turns && !*is_open) outside += c;
  }
  return outside;
}

/// Position of the first cell's closing quote; 0 for a cell without quotes.
size_t FindClosingQuote(std::string_view line) {
  size_t at = line.find_first_not_of(' ');
  if (at == std::string_view::npos || line[at] != '"') return 0;
  for (at = line.find('"', at + 1); at != std::string_view::npos && line.substr(at, 2) == "\"\"";)
    at = line.find('"', at + 2);
  return at;
}

/// A name as it was before QuoteField.
std::string Unquote(std::string_view cell) {
  if (!cell.starts_with('"')) return std::string(WithoutQuotes(cell));
  cell = cell.substr(1, cell.size() - (cell.size() > 1 && cell.ends_with('"') ? 2 : 1));
  if (cell.size() > 1 && cell[0] == '\'' &&
      std::string_view("=+-@\t\r").find(cell[1]) != std::string_view::npos)
    cell.remove_prefix(1);
  std::string name;
  for (size_t i = 0; i < cell.size(); ++i) {
    if (cell.substr(i, 2) == "\"\"") ++i;
    name += cell[i];
  }
  return name;
}

/// Cells of a line, with the quotes that they have.
/// @param separator ' ' for any blanks.
void Split(std::string_view line, char separator, std::vector<std::string_view>* cells) {
  cells->clear();
  if (separator == ' ') {
    for (size_t at = line.find_first_not_of(" \t\r"); at != std::string_view::npos;) {
      const size_t end = std::min(line.find_first_of(" \t\r", at), line.size());
      cells->push_back(line.substr(at, end - at));
      at = line.find_first_not_of(" \t\r", end);
    }
    return;
  }
  for (;;) {
    const size_t close = FindClosingQuote(line);
    const size_t end = line.find(separator, close == std::string_view::npos ? 0 : close);
    cells->push_back(Trim(line.substr(0, end)));
    if (end == std::string_view::npos) return;
    line.remove_prefix(end + 1);
  }
}

class TextRecording : public RecordingReader {
 public:
  TextRecording(const std::filesystem::path& path, size_t width)
      : source_(path == "-" ? "standard input" : path.string()), width_(width) {
    if (path != "-") {
      file_.open(path);
      if (!file_) throw InputError(source_ + ": cannot be read");
    }
    stream_ = path == "-" ? &std::cin : &file_;
    ReadHead();
  }

  bool Next(std::vector<double>* row) override {
    if (!is_pending_ && !ReadLine()) return FinishRow();
    is_pending_ = false;
    row->clear();
    Append(row);
    while (row->size() < width_) {
      if (!ReadLine())
        Fail("the last row has " + std::to_string(row->size()) + " of " + std::to_string(width_) +
             " numbers");
      Append(row);
    }
    if (row->size() != names_.size())
      Fail("must have " + std::to_string(names_.size()) + " numbers as the rows before, got " +
           std::to_string(row->size()));
    return true;
  }

  [[nodiscard]] std::string Where() const override { return source_ + ":" + std::to_string(line_number_); }

 private:
  [[noreturn]] void Fail(const std::string& problem) const {
    throw InputError(TextRecording::Where() + ": " + problem);
  }
  bool FinishRow() const {
    if (stream_->bad()) Fail("cannot be read to its end");
    return false;
  }

  /// The next line that is no comment.
  bool ReadLine() {
    while (stream_->getline(buffer_.data(), kLongestLine) || stream_->gcount() > 0) {
      if (stream_->bad()) break;
      ++line_number_;
      const bool has_end = !stream_->eof() && !stream_->fail();
      if (!has_end && !stream_->eof())
        Fail("a line of more than " + std::to_string(kLongestLine - 2) + " bytes is no row of a recording");
      line_.assign(buffer_.data(), static_cast<size_t>(stream_->gcount()) - (has_end ? 1 : 0));
      if (line_number_ == 1 && line_.starts_with("\xef\xbb\xbf")) line_.erase(0, 3);
      const size_t begin = line_.find_first_not_of(" \t\r");
      if (begin == std::string::npos) continue;
      if (line_[begin] != '#' && line_[begin] != '%') return true;
      comment_ = line_.substr(begin + 1);
    }
    return false;
  }

  void ReadHead() {
    if (!ReadLine()) throw InputError(source_ + ": has no rows");
    if (std::any_of(line_.begin(), line_.end(),
                    [](char c) { return c >= 0 && c < ' ' && c != '\t' && c != '\r'; }))
      Fail("is no text, and no recording that is known");
    bool is_open = false;
    std::string outside = ListUnquoted(line_, &is_open);
    for (std::string begun = line_; is_open && ReadLine(); outside = ListUnquoted(begun, &is_open))
      line_ = begun += "\n" + line_;
    for (const char candidate : {'\t', ';', ','})
      if (separator_ == ' ' && outside.find(candidate) != std::string::npos) separator_ = candidate;
    has_decimal_comma_ = separator_ == ';' && line_.find('.') == std::string::npos;
    Split(line_, separator_, &cells_);
    const bool is_header = std::any_of(cells_.begin(), cells_.end(), [](std::string_view cell) {
      return !WithoutQuotes(cell).empty() && !ParseCell(cell) && cell.find(',') == std::string_view::npos;
    });
    format_ = separator_ == ' ' ? "text" : "CSV";
    if (is_header) {
      std::ranges::transform(cells_, std::back_inserter(names_), Unquote);
    } else {
      // A header may stand in a comment, as NumPy writes it.
      std::vector<std::string_view> names;
      Split(comment_, separator_, &names);
      names_.resize(width_ > 0 ? width_ : cells_.size());
      if (names.size() == names_.size()) std::ranges::transform(names, names_.begin(), Unquote);
      is_pending_ = true;
    }
    has_names_ =
        std::any_of(names_.begin(), names_.end(), [](const std::string& name) { return !name.empty(); });
    if (is_header && has_decimal_comma_) has_decimal_comma_ = false, may_have_decimal_comma_ = true;
  }

  void Append(std::vector<double>* row) {
    if (may_have_decimal_comma_)
      has_decimal_comma_ = line_.find('.') == std::string::npos, may_have_decimal_comma_ = false;
    if (has_decimal_comma_) std::replace(line_.begin(), line_.end(), ',', '.');
    Split(line_, separator_, &cells_);
    for (size_t i = 0; i < cells_.size(); ++i) {
      const std::optional<double> number = WithoutQuotes(cells_[i]).empty() ? kMissing : ParseCell(cells_[i]);
      if (!number)
        Fail("column " + NameOf(row->size()) + ": must be a number, got " + Quote(std::string(cells_[i])));
      row->push_back(*number);
    }
  }
  [[nodiscard]] std::string NameOf(size_t column) const {
    if (column < names_.size() && !names_[column].empty()) return names_[column];
    return std::to_string(column + 1);
  }

  std::string source_;
  size_t width_;
  std::ifstream file_;
  std::istream* stream_ = nullptr;
  std::vector<char> buffer_ = std::vector<char>(kLongestLine);
  std::string line_, comment_;
  long line_number_ = 0;
  char separator_ = ' ';
  bool has_decimal_comma_ = false, may_have_decimal_comma_ = false, is_pending_ = false;
  std::vector<std::string_view> cells_;
};

}  // namespace

bool IsReadOnce(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  return path == "-" || fs::is_fifo(status) || fs::is_socket(status) || fs::is_character_file(status);
}

std::unique_ptr<RecordingReader> OpenRecording(const fs::path& path, const std::string& topic, size_t width) {
  if (IsReadOnce(path)) return OpenTextRecording(path, width);
  if (IsFolder(path)) return OpenRecording(FindBagFile(path), topic, width);
  NoteInput(path);
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

std::unique_ptr<RecordingReader> OpenTextRecording(const std::filesystem::path& path, size_t width) {
  return std::make_unique<TextRecording>(path, width);
}

}  // namespace dexcheck
