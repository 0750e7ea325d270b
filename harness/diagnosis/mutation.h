#pragma once

// Wrong models made on purpose: which of them the checks find, and whether the diagnosis names what was
// changed.

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "harness/descriptions/dynamics_provider.h"
#include "harness/diagnosis/diagnose.h"

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
  Repair expected;  ///< What the diagnosis should name, without values.
  // What it says; for killed mutants.
  std::string named;         ///< Its first cause, in short.
  bool named_equal = false;  ///< The change is listed as an equal repair of the first cause.
  double explained = 0.0;
};

struct MutationOptions {
  double scale = 1e-3;  ///< Change of a parameter relative to itself; of a zero: see ListMutants.
  int samples = 3;      ///< Random states of the checks.
  std::uint64_t seed = 1;
  bool diagnose = true;
};

/// Every parameter of the model by itself, then changes of structure that a specification can express: an
/// axis reversed, a quarter turn, two rows or places exchanged, two bodies exchanged, no armature, no
/// damping, an inertia about the wrong point or in mirrored axes, gravity upside down.
///
/// A parameter changes by `scale` times itself; one that is zero by `scale` times 1 rad, 1 m, the trace of
/// its tensor, the length of its vector, or its unit.
std::vector<Mutant> ListMutants(const RobotSpec& spec, double scale);

/// Whether a cause names what was changed: the same number, or any numbers of the same vector or tensor when
/// several were changed; the same joints for changes of structure.
bool IsNamedBy(const Mutant& mutant, const Repair& cause);

/// Whether another provider of a robot's terms has any other than the model at random states.
bool HasEffect(const RobotModel& model, DynamicsProvider* other, int samples, std::uint64_t seed);

/// Runs the checks, and the diagnosis, on a mutant.
void TryMutant(const RobotModel& model, const mjModel& engine, const std::string& engine_source,
               const MutationOptions& options, Mutant* mutant);

}  // namespace dexcheck
