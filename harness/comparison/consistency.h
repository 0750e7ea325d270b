#pragma once

// Two providers of a robot's terms, compared at random states, no stepping.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/comparison/constant_checks.h"
#include "harness/comparison/term_comparison.h"
#include "harness/descriptions/analytic_provider.h"
#include "harness/descriptions/program_layout.h"
#include "harness/descriptions/robot_part.h"
#include "harness/engine/adapter.h"

namespace dexcheck {

/// Differences that two descriptions may have: constants of joints, couplings, limits of motors.
inline constexpr const char* kIgnorable[] = {"armature", "damping", "friction", "coupling", "effort"};

struct ConsistencyOptions {
  long samples = 10000;
  std::uint64_t seed = 1;
  StateRange range;
  ModelViewFactory make_view = MakeModelView;  ///< Makes the model's side of the comparison.
  ObjectFormulas object;                       ///< Makes the object's equations.
  std::vector<std::string> ignore;             ///< Constants that two files need not share: kIgnorable.
  RobotPart part;                              ///< Part of the two files to compare; empty: the whole robot.
  /// Whether two files agree whose numbers differ by no more than their printed precision.
  bool within_digits = false;
  /// Coarsest precision, relative to a number's size, to which such a number still counts as agreement.
  double precision = 0.01;
};

struct ConsistencyResult {
  ConstantChecks constants;
  std::vector<CheckRecord> terms;
  std::vector<std::string> not_compared;  ///< Names of terms that one of the two lacks.
  long samples = 0;  ///< Number compared: fewer than requested when `progress` ended the work.
  double seconds = 0.0;

  [[nodiscard]] bool Agrees() const;
};

/// Called after each sample with the number done; its false ends the work early.
using Progress = std::function<bool(long)>;

/// Compares all terms that two providers have in common, at random states over the model's joint ranges.
/// `model_value` of a record is that of `first`, `engine_value` that of `second`.
ConsistencyResult CompareTerms(const RobotModel& model, DynamicsProvider* first, DynamicsProvider* second,
                               const ConsistencyOptions& options, const Progress& progress);
/// Compares the terms and constants of a model and an engine.
ConsistencyResult CheckConsistency(const Adapter& adapter, const ConsistencyOptions& options,
                                   const Progress& progress);

/// Compares the terms of a program, results in files or functions with a description's. @param feed gives the
/// states.
ConsistencyResult CompareProviders(const RobotModel& model, DynamicsProvider* first, DynamicsProvider* second,
                                   const StateFeed& feed, const Progress& progress);

/// States as CheckConsistency draws them, without quantities of single terms. The model outlives the feed.
inline StateFeed FeedRandomStates(const RobotModel& model, const ConsistencyOptions& options) {
  return FeedRandomStates(model, options.samples, options.range, options.seed);
}

/// Whether all terms that two providers have in common agree at the first few states.
/// @param tolerance relative, at which terms agree; at least their bound.
bool AgreeAtFirst(const RobotModel& model, DynamicsProvider* a, DynamicsProvider* b, const StateFeed& feed,
                  double tolerance = 0.0);

/// Returns the convention of a floating base, other than the stated one, under which a provider that
/// disagrees would agree in all its terms; none if there is none.
/// @param make_feed states to compare at; the first few are used.
std::optional<BaseConvention> FindOtherConvention(const RobotModel& model, DynamicsProvider* reference,
                                                  LayoutProvider* provider,
                                                  const std::function<StateFeed()>& make_feed);

// Agreement of published numbers, which are rounded when printed.

/// Decimal digits to which two numbers agree whose difference relative to their term's scale is `error`: the
/// largest n with error <= 10^-n, at most 16.
int CountDigits(double error);

}  // namespace dexcheck
