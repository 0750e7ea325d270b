#pragma once

// Two files that describe one robot, compared: what `dexcheck consistency A B` does.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/checks/consistency.h"
#include "harness/descriptions/hypotheses.h"
#include "harness/descriptions/urdf_reader.h"

namespace dexcheck {

/// What was compared: the model that locations belong to, and the results.
struct Comparison {
  std::filesystem::path first;  ///< An MJCF stands second, if there is one.
  std::filesystem::path second;
  bool with_engine = false;  ///< The second is an MJCF, whose terms are the engine's.
  std::optional<RobotModel> model;
  std::vector<std::string> notes;         ///< What its reader may not expect.
  std::vector<std::string> not_compared;  ///< What only one of them has and no term depends on.
  ConsistencyResult result;
  std::vector<Hypothesis> hypotheses;  ///< Faults that would explain what differs.
};

/// Compares constants and terms of two parameter files, URDFs or MJCFs. Of two MJCFs the second is the
/// engine's.
/// @throws InputError for files that cannot be read, and for robots of two mechanisms.
Comparison CompareFiles(
    const std::filesystem::path& a, const std::filesystem::path& b, const UrdfOptions& urdf,
    const ConsistencyOptions& options, const std::function<bool(long)>& progress = [](long) { return true; });

/// Tries the faults that people make on what differs, after any judgement by a tolerance, which is given
/// again: what agrees to it is no fault.
void ExplainComparison(const UrdfOptions& urdf, Comparison* comparison, double tolerance = 0.0);

/// Numbers that were rounded when they were printed agree to so many digits at least.
inline constexpr int kDigitsOfRoundedInput = 4;

/// One line for each constant and term that differs: where first, where worst, both values.
struct Differences {
  std::vector<std::string> real;
  std::vector<std::string> rounded;  ///< Those that agree to kDigitsOfRoundedInput digits or more.
  int digits = 16;                   ///< To which all of `rounded` and what does not differ agree.
};
Differences SortDifferences(const Comparison& comparison);

/// Both kinds in one list.
std::vector<std::string> ListDifferences(const Comparison& comparison);

}  // namespace dexcheck
