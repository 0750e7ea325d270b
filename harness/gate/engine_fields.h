#pragma once

// What becomes of every number of the engine's model: no field of an MJCF may change a force unseen.

#include <span>

namespace dexcheck {

enum class FieldClass {
  kDerived,     ///< The engine's compiler makes it of other fields; no MJCF can set it by itself.
  kCompared,    ///< With the analytic model: by a constant of the gate or a term of `consistency`.
  kReported,    ///< The analytic model has nothing like it: anything but the neutral value is a finding.
  kOverridden,  ///< The plant sets it (scenario), whatever the MJCF says; a note says so where it differs.
  kJudged,    ///< Of the plant alone, contacts and solver: a note names it, and the checks of a run judge it.
  kNoEffect,  ///< On motion and forces, as long as nothing is reported.
};

/// A field of mjModel ("body_mass"), mjOption ("opt.timestep") or mjStatistic ("stat.extent").
struct EngineField {
  const char* name;
  FieldClass outcome;
  /// kCompared, kReported: the check that names it; kOverridden: by what; kJudged: the note that names it;
  /// otherwise why.
  const char* how;
};

/// One entry for each field of the engine's version that this program is built for; a test holds it complete.
std::span<const EngineField> ListEngineFields();

}  // namespace dexcheck
