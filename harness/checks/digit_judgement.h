#pragma once

// Two files that differ, judged by what the digits that they print leave open.

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "harness/checks/consistency.h"
#include "harness/descriptions/printed_digits.h"

namespace dexcheck {

/// One number that differs by more than the digits leave open.
struct DigitExcess {
  std::string check;
  std::string where;
  double units = 0.0;  ///< Difference relative to what is left open; infinite where nothing is.
  double first = 0.0, second = 0.0;
  std::string effect;     ///< Of a constant that one file leaves out.
  bool is_cause = false;  ///< A constant, or a term of geometry or bodies, from which the other terms follow.
};

/// How two files differ that do not agree to rounding.
struct DigitVerdict {
  std::array<PrintedDigits, 2> files;
  long states = 0;                      ///< At which terms were judged.
  std::map<std::string, double> units;  ///< Of each check that does not agree to rounding, its worst.
  std::vector<DigitExcess> excesses;    ///< Causes first, the worst first.
  double largest_within = 0.0;          ///< Relative to its scale, the worst that the digits explain.

  /// Whether a hypothesis is about what exceeds them: single numbers that differ do so within the digits as
  /// well.
  [[nodiscard]] bool Concerns(const std::vector<std::string>& ids,
                              const std::vector<std::string>& parts) const;
};

/// Judges what does not agree to rounding: a number of a file is known to half a unit of its last digit
/// (ReadPrinted). These are carried to each constant and term by reading both files again with all numbers
/// moved by their half units at random (TermComparison::CompareWithin), at the first few states; single
/// numbers are so known to their half unit.
/// @param a, b providers of the two files, in the coordinates of `a`.
/// @param part of the robots that was compared. @param result of the comparison by rounding; what the digits
/// explain passes then, and is no finding.
/// @return nothing, and `result` as it was, when it agrees, when options.within_digits is false, for a robot
/// on wheels or with an object, and where a file's numbers cannot be moved.
std::optional<DigitVerdict> JudgeByDigits(const std::array<const DescriptionFile*, 2>& files,
                                          const UrdfOptions& urdf, const ConsistencyOptions& options,
                                          DynamicsProvider* a, DynamicsProvider* b, const RobotModel& model,
                                          const RobotPart& part, ConsistencyResult* result);

/// One line for each cause, the worst first, and one for all terms that follow from them.
std::vector<std::string> ListExcesses(const DigitVerdict& verdict, const std::string& first,
                                      const std::string& second);

}  // namespace dexcheck
