#pragma once

// Wrong models made on purpose: which of them the checks find, and whether the causes of two files that
// differ name what was changed.

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "harness/comparison/consistency.h"
#include "harness/comparison/file_causes.h"
#include "harness/descriptions/dynamics_provider.h"
#include "harness/diagnosis/parameters.h"

namespace dexcheck {

enum class MutantOutcome {
  kKilled,    ///< The checks disagree.
  kRefused,   ///< The model cannot be built: an input error.
  kNoEffect,  ///< The checks agree, and no term of the model changed at any state tried.
  kSurvived,  ///< The checks agree, but a term changed.
};

/// A fault that was made, and what became of it.
struct TriedFault {
  std::string name;  ///< "link r_forearm: mass".
  std::string kind;  ///< "mass": what the table sums up by.
  MutantOutcome outcome = MutantOutcome::kSurvived;
  std::string failed_checks;  ///< Names, separated by blanks.
  bool named_first = false;   ///< What is named first is the fault.
};

/// Adds the names of those that failed, separated by blanks.
void AddFailed(std::span<const CheckRecord> records, std::string* names);

/// A wrong model.
struct Mutant : TriedFault {
  std::function<void(RobotSpec*)> change;
  Parameter number;  ///< The number that is wrong, or one of the vector or tensor.
  // Found of mutants that the checks find.
  std::string named;         ///< The first cause.
  bool named_equal = false;  ///< The change is an alternative of the first cause.
  double explained = 0.0;
};

struct MutationOptions {
  double scale = 1e-3;  ///< Change of a parameter relative to itself; of a zero: see ListMutants.
  int samples = 3;      ///< Random states of the checks.
  std::uint64_t seed = 1;
  bool diagnose = true;
};

/// Lists every parameter of the model by itself, then faults of a joint or link as people make them: a
/// quarter turn, no armature, no damping, an inertia about the wrong point or in mirrored axes, a solid of
/// another mass, gravity upside down.
///
/// A parameter changes by `scale` times itself; one that is zero by `scale` times 1 rad, 1 m, the trace of
/// its tensor, the length of its vector, or its unit.
std::vector<Mutant> ListMutants(const RobotSpec& spec, double scale);

/// Whether a cause is about the quantity and the place that were changed.
bool IsNamedBy(const RobotSpec& spec, const Parameter& number, const CorrectionItem& cause);

/// Whether another provider of a robot's terms has any other than the model at random states.
bool HasEffect(const RobotModel& model, DynamicsProvider* other, int samples, std::uint64_t seed);

/// Two files that agree, the first of which is changed.
struct MutatedPair {
  explicit MutatedPair(const DescriptionFile& first, const DescriptionFile& second);
  RobotDescription robot;
  RobotModel model;
  MjModelPtr engine;
  std::string source;  ///< Of the engine's model.
  /// The second file as it prints its numbers; none where causes are not found in robots of this kind.
  std::optional<PrintedRobot> reference;
};

/// Runs the checks on a mutant, and looks for the causes.
void TryMutant(const MutatedPair& pair, const MutationOptions& options, Mutant* mutant);

}  // namespace dexcheck
