#pragma once

// How small an error of each number of the model may be and still be found in a run, without looking at the
// model itself: by what it leaves of the balances, by what it predicts, by the torques that it makes of the
// law.

#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "harness/diagnosis/parameters.h"
#include "harness/run/runner.h"

namespace dexcheck {

/// One number of the model.
struct Detectability {
  Parameter parameter;
  std::string name;      ///< "link r_forearm: mass".
  std::string quantity;  ///< "mass".
  // Smallest error that fails each question by itself, relative to GetScale; infinity where none does.
  double robot = kNever;       ///< inverse_dynamics_robot.
  double object = kNever;      ///< inverse_dynamics_object.
  double prediction = kNever;  ///< reduced_acceleration or contact_force.
  double law = kNever;         ///< law_torque.

  static constexpr double kNever = std::numeric_limits<double>::infinity();
};

/// What a run says of the model's numbers.
struct DetectabilityResult {
  std::vector<Detectability> numbers;
  /// Of the matrix whose columns are what a relative error of one leaves of (48), in |.|_M^-1 relative to the
  /// forces balanced, at all states that were looked at: the largest singular value, the smallest that is not
  /// rounding, and how many there are. The other columns are sums of these.
  double largest_singular_value = 0.0, smallest_singular_value = 0.0;
  int rank = 0;
};

/// Runs a scenario and changes every number of the model at some of its states: to first order, what is left
/// of (48) and (19) with the plant's accelerations and forces; what (46), (48) predict under its torques; and
/// what the law's torques are; each against the bound at that state, with what tilt and contacts that give
/// are allowed there.
/// @param states how many are looked at, evenly over the run.
/// @throws InputError for a task; when the run fails. Stops early, with fewer numbers, when `go_on` says so
/// after one.
DetectabilityResult FindDetectability(const Setup& setup, int states,
                                      const std::function<bool(size_t done, size_t all)>& go_on);

/// A question's claim, made in a run as it is: this error of one number, in runs that differ by their seeds.
struct RetriedError {
  double error = 0.0;  ///< Relative to GetScale: as claimed, or twice or four times that when fewer found it.
  int found = 0;       ///< Runs in which one of the checks failed,
  int runs = 0;        ///< of these.
};
inline constexpr int kRetrySeeds = 5;

/// Runs the scenario with the error until one of `checks` fails, with each seed from 1 to kRetrySeeds; when
/// not all runs find it, with twice the error, and once more. A seed without such a robot or grasp has no
/// run.
RetriedError RetryError(const Scenario& scenario, const std::filesystem::path& robot,
                        const std::filesystem::path& mjcf, const Parameter& parameter, double error,
                        const std::vector<std::string>& checks, const std::function<bool()>& should_stop);

}  // namespace dexcheck
