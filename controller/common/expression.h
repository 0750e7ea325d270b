#pragma once

#include <map>
#include <string>
#include <string_view>

namespace dexcheck {

/// Named numbers that an expression may use.
using SymbolTable = std::map<std::string, double, std::less<>>;

/// Whether the text can name a symbol: a letter or underscore, then letters, digits and underscores; not
/// "pi".
bool IsSymbolName(std::string_view text);

/// Value of arithmetic: + - * / with the usual precedence, parentheses, numbers, pi and the given symbols.
/// The result is not finite where the arithmetic overflows or divides by zero.
/// @throws std::invalid_argument that says what is wrong and where, in one line.
double EvaluateExpression(std::string_view text, const SymbolTable& symbols);

}  // namespace dexcheck
