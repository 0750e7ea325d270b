#include "controller/common/expression.h"

#include <charconv>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "controller/common/text.h"
#include "controller/common/types.h"

namespace dexcheck {
namespace {

constexpr int kMaxDepth = 64;

bool IsDigit(char c) { return '0' <= c && c <= '9'; }
bool IsLetter(char c) { return ('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z') || c == '_'; }

/// Recursive descent over
///   sum     = product {("+" | "-") product}
///   product = factor {("*" | "/") factor}
///   factor  = {"+" | "-"} (number | symbol | "(" sum ")")
class Parser {
 public:
  Parser(std::string_view text, const SymbolTable& symbols) : text_(text), symbols_(symbols) {}

  double ParseAll() {
    const double value = ParseSum();
    SkipBlanks();
    if (at_ < text_.size()) Fail("unexpected " + Quote(text_.substr(at_)));
    return value;
  }

 private:
  [[noreturn]] void Fail(const std::string& problem) const {
    throw std::invalid_argument(problem + " at character " + std::to_string(at_ + 1));
  }

  void SkipBlanks() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t')) ++at_;
  }

  bool Accept(char c) {
    SkipBlanks();
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }

  double ParseSum() {
    double value = ParseProduct();
    while (true) {
      if (Accept('+')) {
        value += ParseProduct();
      } else if (Accept('-')) {
        value -= ParseProduct();
      } else {
        return value;
      }
    }
  }

  double ParseProduct() {
    double value = ParseFactor();
    while (true) {
      if (Accept('*')) {
        value *= ParseFactor();
      } else if (Accept('/')) {
        value /= ParseFactor();
      } else {
        return value;
      }
    }
  }

  double ParseFactor() {
    double sign = 1.0;
    while (true) {
      if (Accept('-')) {
        sign = -sign;
      } else if (!Accept('+')) {
        return sign * ParseOperand();
      }
    }
  }

  double ParseOperand() {
    if (Accept('(')) return ParseGroup();
    if (at_ >= text_.size()) Fail("a number, symbol or \"(\" is missing");
    const char c = text_[at_];
    if (IsDigit(c) || c == '.') return ParseNumber();
    if (IsLetter(c)) return ParseSymbol();
    Fail("unexpected " + Quote(text_.substr(at_)));
  }

  double ParseGroup() {
    if (++depth_ > kMaxDepth) Fail("more than " + std::to_string(kMaxDepth) + " nested parentheses");
    const double value = ParseSum();
    if (!Accept(')')) Fail("\")\" is missing");
    --depth_;
    return value;
  }

  double ParseNumber() {
    double value = 0.0;
    const char* begin = text_.data() + at_;
    const std::from_chars_result result = std::from_chars(begin, text_.data() + text_.size(), value);
    if (result.ec == std::errc::result_out_of_range) Fail("number out of range");
    if (result.ec != std::errc()) Fail("malformed number");
    at_ += static_cast<size_t>(result.ptr - begin);
    return value;
  }

  double ParseSymbol() {
    size_t end = at_;
    while (end < text_.size() && (IsLetter(text_[end]) || IsDigit(text_[end]))) ++end;
    const std::string_view name = text_.substr(at_, end - at_);
    const double value = LookUp(name);
    at_ = end;
    return value;
  }

  double LookUp(std::string_view name) const {
    if (name == "pi") return kPi;
    const auto found = symbols_.find(name);
    if (found != symbols_.end()) return found->second;
    std::vector<std::string> known = {"pi"};
    for (const auto& [symbol, value] : symbols_) known.push_back(symbol);
    Fail("unknown symbol " + Quote(name) + SuggestInBrackets(name, known));
  }

  std::string_view text_;
  const SymbolTable& symbols_;
  size_t at_ = 0;
  int depth_ = 0;
};

}  // namespace

bool IsSymbolName(std::string_view text) {
  if (text.empty() || !IsLetter(text[0]) || text == "pi") return false;
  return text.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_") ==
         std::string_view::npos;
}

double EvaluateExpression(std::string_view text, const SymbolTable& symbols) {
  return Parser(text, symbols).ParseAll();
}

}  // namespace dexcheck
