#pragma once

// Two files that differ, judged by their printed precision.

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "harness/comparison/consistency.h"
#include "harness/comparison/printed_digits.h"
#include "harness/descriptions/urdf_reader.h"

namespace dexcheck {

/// The number with the coarsest comparison among those that differ by more than rounding.
struct LoosestNumber {
  std::string what;       ///< "inertia of link3"; empty where all agree to rounding.
  double fraction = 0.0;  ///< Precision to which it was compared, relative to its size.
};

/// How two files differ that do not agree to rounding.
struct DigitVerdict {
  std::array<PrintedDigits, 2> files;
  long states = 0;  ///< Number of states at which terms were judged.
  std::map<std::string, double>
      units;  ///< Worst excess of each check that does not agree to rounding, in units of its precision.
  std::vector<ConstantFinding> excesses;  ///< Numbers and terms; causes first, the worst first.
  LoosestNumber loosest;
};

/// Judges the differences above rounding: a number of a file is known to half a unit of its last digit
/// (ReadPrinted). These half units are carried to each constant and term by reading both files again with all
/// numbers moved at random within them (TermComparison::CompareWithin), at the first few states; a single
/// number keeps its own half unit.
/// @param a, b providers of the two files, in the coordinates of `a`.
/// @param part of the robots that was compared. @param result of the comparison by rounding; differences that
/// the printed precision explains pass then, and are no findings.
/// @return nothing, with `result` unchanged, when it agrees, when options.within_digits is false, for a robot
/// on wheels or with an object, and where a file's numbers cannot be moved.
std::optional<DigitVerdict> JudgeByDigits(const std::array<const DescriptionFile*, 2>& files,
                                          const UrdfOptions& urdf, const ConsistencyOptions& options,
                                          DynamicsProvider* a, DynamicsProvider* b, const RobotModel& model,
                                          const RobotPart& part, ConsistencyResult* result);

}  // namespace dexcheck
