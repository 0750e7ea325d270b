#pragma once

// Which part of a plant that is not ideal costs the accuracy?

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "harness/scenario/scenario.h"

namespace dexcheck {

/// One thing in which a scenario's plant is not ideal.
struct ErrorSource {
  std::string name;  ///< Its key: "sensing.joint_counts", "disturbance.0".
  /// Takes it out. The random numbers of the others stay as they are.
  std::function<void(Imperfections*)> drop;
  bool acts_at_rest = true;  ///< Whether its error is there before t = 0: all but pushes and noise.
};

/// Those that do something. `actuation.saturate` is no source: it says what becomes of a limit.
std::vector<ErrorSource> ListErrorSources(const Imperfections& imperfections);

/// Size of an error over a run: of the object's position, m; of a motion of joints at each step the joint
/// that is farthest from its place, rad or m.
struct ErrorSize {
  double rms = 0.0;
  double max = 0.0;
};

/// One source.
struct BudgetEntry {
  std::string name;
  ErrorSize alone;      ///< With this source only.
  ErrorSize without;    ///< With all others.
  ErrorSize predicted;  ///< To first order, see ErrorPrediction; not a number of a law that is not known.
  /// RMS of what it adds in company less what it adds alone, relative to the RMS of all.
  double interaction = 0.0;
  std::string failure;  ///< Why one of its two runs ended early; empty when none did.

  /// A source interacts where it makes another error in company than alone, by more than kInteracts.
  [[nodiscard]] bool interacts() const { return interaction > kInteracts; }
  static constexpr double kInteracts = 0.1;
};

/// All sources of a scenario. Errors are judged from `expect.from` on.
struct ErrorBudget {
  std::string scenario;
  bool of_joints = false;  ///< The errors are those of a motion of joints.
  std::string unit = "m";  ///< Or "rad", "rad or m".
  ErrorSize ideal;         ///< With no source.
  ErrorSize all;           ///< With every source.
  ErrorSize sum;           ///< Errors of the runs with one source each, added as functions of time.
  ErrorSize predicted;     ///< Likewise of the predictions.
  std::string failure;     ///< Why the ideal run or that with all ended early; empty when none did.
  std::vector<BudgetEntry> entries;

  /// Whether every run came to its end.
  [[nodiscard]] bool is_complete() const;
};

/// Runs the scenario 2 n + 2 times for its n sources, unchecked, `jobs` runs at a time.
/// @param progress called often with the number of runs done and to do; false stops.
/// @throws InputError as Setup; when the scenario is a task or its plant is ideal.
ErrorBudget CalcErrorBudget(const Scenario& scenario, const std::filesystem::path& robot,
                            const std::filesystem::path& mjcf, int jobs,
                            const std::function<bool(long done, long total)>& progress);

nlohmann::ordered_json ToJson(const ErrorBudget& budget);

}  // namespace dexcheck
