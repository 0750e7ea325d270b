#pragma once

namespace dexcheck::testing {

/// Derivative at 0 of a function of one variable by five points: error h^4 f'''''/30, rounding about
/// eps |f| / h.
template <typename Function>
auto Differentiate(const Function& f, double h) {
  using Value = decltype(f(0.0));
  return Value(((f(-2.0 * h) - f(2.0 * h)) + 8.0 * (f(h) - f(-h))) / (12.0 * h));
}

}  // namespace dexcheck::testing
