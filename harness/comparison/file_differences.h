#pragma once

// The differences of two files as lines of text.

#include <string>
#include <vector>

#include "harness/comparison/file_comparison.h"

namespace dexcheck {

/// Least number of digits to which numbers agree that were rounded when they were printed.
inline constexpr int kDigitsOfRoundedInput = 4;

/// One line for each constant and term that differs: where first, where worst, both values.
struct Differences {
  std::vector<std::string> real;
  std::vector<std::string> rounded;  ///< Those that agree to kDigitsOfRoundedInput digits or more.
  std::string following;             ///< One line for all terms that follow from `real`.
  int digits = 16;                   ///< Digits to which all of `rounded` and everything else agree.
};
Differences SortDifferences(const Comparison& comparison);

/// Constants that differ and that no cause concerns: statements of an MJCF beside the mechanism.
std::vector<std::string> ListOtherDifferences(const Comparison& comparison);

/// The causes, or where there are none all differences, a line each.
std::vector<std::string> ListDifferences(const Comparison& comparison);

}  // namespace dexcheck
