#pragma once

// One robot in several engines: the terms of all of them at the same states, each pair compared.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/comparison/consistency.h"
#include "harness/comparison/term_comparison.h"
#include "harness/descriptions/program_provider.h"
#include "harness/descriptions/read_description.h"

namespace dexcheck {

/// Search paths of the engines, and their inputs.
struct EngineComparisonOptions {
  /// Names of ListEngineComparisonEngines; empty: all that are there.
  std::vector<std::string> engines;
  /// Programs of the user's own, "NAME=COMMAND".
  std::vector<std::string> programs;
  std::filesystem::path mjcf;             ///< File that MuJoCo reads instead of the robot's; may be empty.
  std::filesystem::path programs_folder;  ///< Folder of the programs that come with dexcheck.
  std::filesystem::path node_modules;     ///< Folder in which npm installed MuJoCo 3; may be empty.
  ProgramOptions program_options = {.seconds = 60.0};  ///< Node and large engines start slowly.
  ConsistencyOptions states;
  /// Relative difference at which two engines still agree. They have algorithms of their own: one that
  /// inverts M loses as many digits as M's condition number has, and MuJoCo 2.2.2 diagonalises inertias to
  /// 1e-6 or better.
  double tolerance = 1e-6;
};

/// Name of an engine, and its description: "analytic", "mujoco", "mujoco3", "bullet", "kdl", "simbody".
struct EngineComparisonEngine {
  std::string name;
  std::string description;
};
const std::vector<EngineComparisonEngine>& ListEngineComparisonEngines();

/// Results of all engines together.
struct EngineComparisonResult {
  std::vector<std::string> names;   ///< The providers' own names.
  std::vector<std::string> absent;  ///< "kdl: why it is not compared".
  bool lacks_requested = false;     ///< Whether one of them was requested by name.
  std::vector<std::string> notes;
  std::vector<ComparedPair> pairs;  ///< Judged by the tolerance.
  std::vector<std::vector<size_t>>
      groups;                         ///< Providers that agree with each other; the largest group first.
  std::vector<std::string> settings;  ///< "MuJoCo 2.2.2: as if ...": which setting explains a provider.
  long samples = 0;

  [[nodiscard]] bool Agrees() const { return groups.size() <= 1; }
};

/// Compares the engines. @param robot the description of `file`, whose analytic model is the first of them.
/// @throws InputError for unknown names, and when fewer than two engines are left.
EngineComparisonResult RunEngineComparison(const DescriptionFile& file, const RobotDescription& robot,
                                           const EngineComparisonOptions& options,
                                           const std::function<bool(long)>& progress);

}  // namespace dexcheck
