#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/common/toml_reader.h"

namespace dexcheck {
namespace {

/// Measures how deeply TOML text is nested. The parser builds and destroys its tree by recursion; it allows
/// more nested brackets than a small stack can take, and any number of dots in a key.
class NestingScanner {
 public:
  static constexpr int kMaxBrackets = 32;
  static constexpr int kMaxDots = 16;

  explicit NestingScanner(std::string_view text) : text_(text) {}

  /// The line on which brackets or dotted keys go too deep; 0 when none does.
  int FindTooDeep() {
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '"' || c == '\'') {
        SkipString(c);
        continue;
      }
      if (c == '#') {
        at_ = std::min(text_.find('\n', at_), text_.size());
        continue;
      }
      Count(c);
      if (brackets_ > kMaxBrackets || dots_ > kMaxDots) return line();
      ++at_;
    }
    return 0;
  }

 private:
  void Count(char c) {
    if (c == '[' || c == '{') ++brackets_;
    if (c == ']' || c == '}') brackets_ = std::max(brackets_ - 1, 0);
    if (c == '.') ++dots_;
    if (std::string_view("[]{}=,\n").find(c) != std::string_view::npos) dots_ = 0;
  }

  /// Moves past the string that opens here. One that is not closed ends with the text; the parser reports it.
  void SkipString(char quote) {
    const std::string triple(3, quote);
    const std::string closing = text_.substr(at_, 3) == triple ? triple : std::string(1, quote);
    at_ += closing.size();
    while (at_ < text_.size() && text_.substr(at_, closing.size()) != closing) {
      at_ += (text_[at_] == '\\' && quote == '"') ? 2 : 1;
    }
    at_ = std::min(at_ + closing.size(), text_.size());
  }

  [[nodiscard]] int line() const {
    return 1 + static_cast<int>(
                   std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(at_), '\n'));
  }

  std::string_view text_;
  size_t at_ = 0;
  int brackets_ = 0;
  int dots_ = 0;
};

void CheckSize(size_t size, std::string_view source) {
  if (size <= TomlDocument::kMaxSize) return;
  throw InputError(std::string(source) + ": must be at most " + std::to_string(TomlDocument::kMaxSize) +
                   " bytes long");
}

enum class Change { kSet, kAppend, kRemove };

/// Changes what stands at a path, whose parts are keys and numbers of list entries.
/// @param value gets moved away. @param fail throws for a reason.
void Place(std::string_view path, Change mode, toml::node* value,
           const std::function<void(const std::string& why)>& fail, toml::table* root) {
  toml::node* at = root;
  size_t begin = 0;
  while (true) {
    const size_t dot = path.find('.', begin);
    const std::string_view key = path.substr(begin, dot - begin);
    const bool is_last = dot == std::string_view::npos;
    if (key.empty()) fail("its path has an empty part");
    if (toml::array* const list = at->as_array()) {
      const size_t index = ParseNumber<size_t>(key).value_or(list->size());
      if (index >= list->size())
        fail(Quote(key) + " is no entry of a list of " + std::to_string(list->size()));
      const auto entry = list->cbegin() + static_cast<std::ptrdiff_t>(index);
      if (is_last && mode == Change::kRemove) return (void)list->erase(entry);
      if (is_last) return (void)list->replace(entry, std::move(*value));
      at = list->get(index);
    } else if (toml::table* const table = at->as_table()) {
      const bool is_there = table->contains(key);
      if (mode == Change::kRemove && !is_there) fail(Quote(path.substr(0, dot)) + " is not there");
      if (is_last && mode == Change::kRemove) return (void)table->erase(key);
      if (is_last && mode == Change::kSet) return (void)table->insert_or_assign(key, std::move(*value));
      if (!is_there && is_last) table->insert(key, toml::array{});
      if (!is_there && !is_last) table->insert(key, toml::table{});
      at = table->get(key);
      if (is_last && !at->is_array()) fail(Quote(path) + " is no list");
      if (is_last) return at->as_array()->push_back(std::move(*value));
    } else {
      fail(Quote(path.substr(0, begin - 1)) + " is no table or list");
    }
    begin = dot + 1;
  }
}

/// TomlDocument::Override. "PATH+=VALUE" adds an entry to a list, which is made when it is not there;
/// "PATH-=" removes a key that is there.
void Assign(std::string_view assignment, toml::table* root) {
  // Messages show the assignment shortened and without control characters.
  const bool removes = assignment.ends_with("-=");
  const std::string label =
      Abbreviate(removes ? "--unset " + std::string(assignment.substr(0, assignment.size() - 2))
                         : "--set " + std::string(assignment));
  const auto fail = [&](const std::string& why) { throw InputError(label + ": " + why); };
  CheckSize(assignment.size(), "--set");
  const size_t equals = assignment.find('=');
  if (equals == std::string_view::npos) fail("must be PATH=VALUE");
  const bool appends = equals > 0 && assignment[equals - 1] == '+';
  const std::string_view path = assignment.substr(0, appends || removes ? equals - 1 : equals);
  const std::string_view value = assignment.substr(equals + 1);
  if (NestingScanner(value).FindTooDeep() > 0 || NestingScanner(path).FindTooDeep() > 0) {
    fail("nested too deeply");
  }
  toml::table parsed;
  const std::string text(value);
  for (const std::string& form : {"value = " + text, "value = '''" + text + "'''"}) {
    try {
      parsed = toml::parse(form, label);
    } catch (const toml::parse_error&) {
      continue;
    }
    if (parsed.size() == 1) break;  // more keys mean that the value had a line break in it
  }
  if (parsed.size() != 1) fail("is not a value");
  const Change mode = removes ? Change::kRemove : appends ? Change::kAppend : Change::kSet;
  Place(path, mode, parsed.get("value"), fail, root);
}

}  // namespace

TomlDocument::TomlDocument(std::string_view text, std::string_view source)
    : context_(std::make_unique<TomlContext>(TomlContext{std::string(source), {}, {}})) {
  CheckSize(text.size(), source);
  if (const int line = NestingScanner(text).FindTooDeep(); line > 0) {
    throw InputError(context_->source + ":" + std::to_string(line) + ": nested too deeply, more than " +
                     std::to_string(NestingScanner::kMaxBrackets) + " brackets or " +
                     std::to_string(NestingScanner::kMaxDots) + " dots");
  }
  try {
    root_ = std::make_unique<toml::table>(toml::parse(text));
  } catch (const toml::parse_error& error) {
    throw InputError(context_->source + ":" + std::to_string(error.source().begin.line) +
                     ": syntax error: " + Abbreviate(error.description()));
  }
}

TomlDocument::TomlDocument(const TomlDocument& other)
    : context_(std::make_unique<TomlContext>(*other.context_)),
      root_(std::make_unique<toml::table>(*other.root_)) {}

TomlTable TomlDocument::Open() const { return {*context_, TomlValue(*context_, *root_, ""), *root_}; }

void TomlDocument::Override(std::string_view assignment) { Assign(assignment, root_.get()); }

void TomlDocument::Set(std::string_view path, double number) {
  constexpr double kMostWhole = 0x1p53;
  const auto fail = [&](const std::string& why) {
    throw InputError(Abbreviate("--set " + std::string(path) + "=" + FormatNumber(number)) + ": " + why);
  };
  if (NestingScanner(path).FindTooDeep() > 0) fail("nested too deeply");
  if (std::abs(number) < kMostWhole && number == std::floor(number)) {
    toml::value<std::int64_t> whole(static_cast<std::int64_t>(number));
    Place(path, Change::kSet, &whole, fail, root_.get());
  } else {
    toml::value<double> value(number);
    Place(path, Change::kSet, &value, fail, root_.get());
  }
}

std::string ApplyOverrides(const std::string& text, const std::string& source,
                           const std::vector<std::string>& overrides) {
  if (overrides.empty()) return text;
  (void)TomlDocument(text, source);  // which says what is wrong with it
  toml::table root = toml::parse(text);
  for (const std::string& assignment : overrides) Assign(assignment, &root);
  std::ostringstream stream;
  stream << root << '\n';
  return stream.str();
}

std::string QuoteToml(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : MendUtf8(text)) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      quoted += "\\u00";
      for (const int digit : {c >> 4, c & 15}) quoted += "0123456789abcdef"[digit];
      continue;
    }
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + "\"";
}

std::string ReadTextFile(const std::string& path) {
  const auto fail = [&](const std::string& why) { throw InputError(path + ": cannot be read: " + why); };
  if (std::error_code ignored; std::filesystem::is_directory(path, ignored)) fail("is a directory");
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) fail(std::strerror(errno));
  std::string text(TomlDocument::kMaxSize + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad()) fail(std::strerror(errno));
  text.resize(static_cast<size_t>(file.gcount()));
  CheckSize(text.size(), path);
  return text;
}

}  // namespace dexcheck
