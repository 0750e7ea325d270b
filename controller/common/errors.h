#pragma once

// The errors that the library throws. A caller's fault is std::invalid_argument (through Require);
// everything else derives from Error, so that a program can distinguish input errors from
// simulation failures.

#include <cmath>
#include <stdexcept>
#include <string>
#include <string_view>

#include "controller/common/text.h"

namespace dexcheck {

/// Base of the project's own errors.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A file that cannot be used: unreadable, malformed, or with a value that makes no sense. The message is one
/// line that names the file, the key and the value.
class InputError : public Error {
 public:
  using Error::Error;
};

/// A representation that breaks down at the given state (for example ZYZ angles at sin(beta) = 0).
class SingularityError : public Error {
 public:
  SingularityError(const std::string& message, double value) : Error(message), value_(value) {}
  /// The number that came too close to singular: a condition number, or the angle in rad.
  [[nodiscard]] double value() const { return value_; }

 private:
  double value_;
};

/// Throws std::invalid_argument "name: requirement, got value" unless `condition` holds.
/// @param value a number or an enumerator.
template <typename Value>
void Require(bool condition, std::string_view name, std::string_view requirement, Value value) {
  if (condition) return;
  throw std::invalid_argument(std::string(name) + ": " + std::string(requirement) + ", got " +
                              FormatNumber(static_cast<double>(value)));
}

/// Throws as Require unless the value is finite and positive.
inline void RequirePositive(double value, std::string_view name) {
  Require(std::isfinite(value) && value > 0.0, name, "must be positive", value);
}

/// Throws as Require unless the value is finite and not negative.
inline void RequireNotNegative(double value, std::string_view name) {
  Require(std::isfinite(value) && value >= 0.0, name, "must not be negative", value);
}

}  // namespace dexcheck
