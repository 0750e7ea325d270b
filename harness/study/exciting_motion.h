#pragma once

// Exciting motions: the oscillations of a scenario, changed so that the model's numbers show best.

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "harness/scenario/scenario.h"

namespace dexcheck {

/// A number of the scenario's motion that may be changed.
struct MotionKey {
  std::string key;  ///< As an override takes it: "trajectory.parts.1.frequency".
  double value = 0.0;
  double from = 0.0, to = 0.0;  ///< Its range, in which it is varied by its logarithm.
};

/// Amplitudes and frequencies of oscillations, speed, amplitude and wavelength of weaves, of a trajectory or
/// the parts of a sum; of a motion of joints those of its oscillations. Amplitudes may be a third to three
/// times what the scenario has, the others half to twice.
/// @throws InputError as the scenario's reader.
std::vector<MotionKey> ListMotionKeys(const Scenario& scenario);

/// What one motion comes to.
struct JudgedMotion {
  std::vector<double> values;  ///< By key.
  std::string failure;         ///< Why its run ended early.
  VectorXd singular_values;    ///< As CalcSingularValues.
  double smallest = 0.0;       ///< The one whose number is ExcitingMotion::rank.
  std::string nearest;         ///< The check that takes most of what it may, and how much.
  double excess = 0.0;         ///< How far the checks are above what they may take, as a sum of logarithms.

  [[nodiscard]] double condition() const { return singular_values[0] / smallest; }
};

struct ExcitingMotionOptions {
  int runs = 200;
  /// Of its bound that each check may take; or as much as with the motion given, where that is more.
  double fraction = 0.5;
};

/// The best motion that was found.
struct ExcitingMotion {
  std::vector<MotionKey> keys;
  double floor = 0.0;  ///< Of inverse_dynamics_robot: what a combination must leave to show, relative.
  int rank = 0;        ///< Combinations of numbers that show with the motion given.
  JudgedMotion given, found;
  int runs = 0;                        ///< That were made.
  std::vector<std::string> overrides;  ///< That make the scenario's motion the one found.
};

/// Maximises the singular value of that rank of the regressor along the run, over the keys, by COBYLA
/// (M. J. D. Powell, 1994; NLopt's): each check of questions two to five is a constraint, so joints stay in
/// their ranges, torques below their limits, fingertips and wheels inside their cones, and contacts as stiff
/// as the balances need.
/// @param go_on called before each run with the number of runs made; false ends the search.
/// @throws InputError as Setup; when the scenario has no such key or does not pass as it is.
ExcitingMotion FindExcitingMotion(const Scenario& scenario, const std::filesystem::path& robot,
                                  const std::filesystem::path& mjcf, const ExcitingMotionOptions& options,
                                  const std::function<bool(int runs)>& go_on);

}  // namespace dexcheck
