#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

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

}  // namespace

TomlDocument::TomlDocument(std::string_view text, std::string_view source)
    : context_(std::make_unique<TomlContext>(TomlContext{std::string(source), {}})) {
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

TomlTable TomlDocument::Open() const { return {*context_, TomlValue(*context_, *root_, ""), *root_}; }

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
