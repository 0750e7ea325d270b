#pragma once

// --digits and --tolerance: how published numbers, which are rounded when printed, are judged.

#include <array>
#include <cmath>
#include <optional>

#include "harness/cli/command_line.h"

namespace dexcheck::cli {

/// What was given of them.
struct ToleranceOptions {
  int digits = 0;                   ///< 0: not given.
  std::optional<double> tolerance;  ///< Relative, wider than rounding.

  /// The relative tolerance; none: by rounding.
  [[nodiscard]] std::optional<double> Find() const {
    return digits > 0 ? std::pow(10.0, -digits) : tolerance;
  }
};

/// Adds the two options, of which one may be given. @returns them.
inline std::array<Option, 2> AddToleranceOptions(Command command, ToleranceOptions* options) {
  constexpr int kMostDigits = 15;
  const Option digits = command
                            .AddOption("--digits", &options->digits,
                                       "Agreement to this many digits of a term's scale is enough")
                            .TypeName("N")
                            .Check(WholeNumber(1, kMostDigits));
  const Option tolerance =
      command.AddOption("--tolerance", &options->tolerance, "The same as a relative tolerance")
          .TypeName("REL")
          .Check(Fraction())
          .Excludes(digits);
  return {digits, tolerance};
}

}  // namespace dexcheck::cli
