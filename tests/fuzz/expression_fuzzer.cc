// EvaluateExpression: any text is a number or a one-line error, and blanks or parentheses around it change
// neither.

#include <bit>
#include <optional>
#include <stdexcept>
#include <string>

#include "controller/common/expression.h"
#include "tests/fuzz/fuzz_target.h"

namespace dexcheck::testing::fuzz {
namespace {

std::optional<double> Evaluate(std::string_view text) {
  static const SymbolTable symbols = {{"L_1", 0.25}, {"L_2", -3.0}, {"_x", 8.0}};
  try {
    return EvaluateExpression(text, symbols);
  } catch (const std::invalid_argument& error) {
    ExpectGoodMessage(error.what(), "");
    return std::nullopt;
  }
}

bool IsSame(double a, double b) { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }

}  // namespace
}  // namespace dexcheck::testing::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dexcheck::testing::fuzz;
  const std::string text(AsText(data, size));
  const std::optional<double> value = Evaluate(text);
  const std::optional<double> spaced = Evaluate(" \t" + text + " ");
  Expect(value.has_value() == spaced.has_value(), "blanks decide", text);
  if (!value) return 0;
  Expect(IsSame(*value, *spaced), "blanks change the value", text);
  // One more pair of parentheses may be one too many.
  const std::optional<double> grouped = Evaluate("(" + text + ")");
  if (grouped) Expect(IsSame(*value, *grouped), "parentheses change the value", text);
  return 0;
}
