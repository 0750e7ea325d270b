#include "controller/common/expression.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "controller/common/types.h"
#include "tests/common/throws.h"

namespace dexcheck::testing::expression_test {
namespace {

const SymbolTable& Symbols() {
  static const SymbolTable symbols = {{"L_1", 0.25}, {"L_3p", 8.0}, {"_x", -3.0}};
  return symbols;
}

std::string CatchProblem(const std::string& text) {
  return MessageOf<std::invalid_argument>([&] { return EvaluateExpression(text, Symbols()); });
}

TEST(Expression, FollowsPrecedenceAndAssociativity) {
  // Exact in binary, hence compared without tolerance.
  EXPECT_EQ(EvaluateExpression("2", {}), 2.0);
  EXPECT_EQ(EvaluateExpression("1 + 2 * 3", {}), 7.0);
  EXPECT_EQ(EvaluateExpression("(1 + 2) * 3", {}), 9.0);
  EXPECT_EQ(EvaluateExpression("10 - 4 - 3", {}), 3.0);
  EXPECT_EQ(EvaluateExpression("16 / 4 / 2", {}), 2.0);
  EXPECT_EQ(EvaluateExpression("2 - -3", {}), 5.0);
  EXPECT_EQ(EvaluateExpression("-+-2*-.5", {}), -1.0);
  EXPECT_EQ(EvaluateExpression("\t1.5e3/3 ", {}), 500.0);
}

TEST(Expression, KnowsSymbolsAndPi) {
  EXPECT_EQ(EvaluateExpression("-(L_3p + L_1)", Symbols()), -8.25);
  EXPECT_EQ(EvaluateExpression("_x*L_1", Symbols()), -0.75);
  EXPECT_EQ(EvaluateExpression("pi / 2", Symbols()), kPi / 2.0);
}

TEST(Expression, LeavesOverflowToTheCaller) {
  EXPECT_TRUE(std::isinf(EvaluateExpression("1 / 0", {})));
  EXPECT_TRUE(std::isnan(EvaluateExpression("0 / 0", {})));
  EXPECT_TRUE(std::isinf(EvaluateExpression("1e200 * 1e200", {})));
}

TEST(Expression, SaysWhatIsWrongAndWhere) {
  constexpr std::pair<const char*, const char*> kProblems[] = {
      {"", R"(a number, symbol or "(" is missing at character 1)"},
      {"1 +", R"(a number, symbol or "(" is missing at character 4)"},
      {"1 2", R"(unexpected "2" at character 3)"},
      {"2 ^ 3", R"(unexpected "^ 3" at character 3)"},
      {"0x10", R"(unexpected "x10" at character 2)"},
      {"(1 + 2", "\")\" is missing at character 7"},
      {"1)", "unexpected \")\" at character 2"},
      {"*2", R"(unexpected "*2" at character 1)"},
      {".", "malformed number at character 1"},
      {"1e999", "number out of range at character 1"},
      {"2 * L_2", R"(unknown symbol "L_2" (did you mean "L_1"?) at character 5)"},
      {"inf", R"(unknown symbol "inf" at character 1)"},
  };
  for (const auto& [text, problem] : kProblems) EXPECT_EQ(CatchProblem(text), problem);
}

TEST(Expression, BoundsItsRecursion) {
  EXPECT_EQ(EvaluateExpression(std::string(64, '(') + "1" + std::string(64, ')'), {}), 1.0);
  EXPECT_EQ(CatchProblem(std::string(1000000, '(')), "more than 64 nested parentheses at character 66");
  EXPECT_EQ(EvaluateExpression(std::string(1000000, '-') + "1", {}), 1.0);
}

TEST(Expression, IdentifiesWhatCanNameASymbol) {
  for (const char* name : {"L_1", "h_f1", "_", "Pi"}) EXPECT_TRUE(IsSymbolName(name)) << name;
  for (const char* name : {"", "1a", "a-b", "a b", "pi"}) EXPECT_FALSE(IsSymbolName(name)) << name;
}

}  // namespace
}  // namespace dexcheck::testing::expression_test
