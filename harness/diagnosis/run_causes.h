#pragma once

// All that explains a run's residuals, by channel. Empty where nothing differs.

#include "harness/diagnosis/causes.h"
#include "harness/diagnosis/step_store.h"

namespace dexcheck {

/// Explains E_bar' (tau' - tau'_printed) = sum_i (factor_i - 1) part_i by the summands of the reference law,
/// of all torques or of one joint, finger or wheel.
Causes ExplainLaw(const StepStore& store);

/// Explains v +- w b / 2 - r thetadot of both wheels: another radius leaves dr thetadot, another distance
/// -+ w db / 2. What wheels slip and sink is noise.
Causes ExplainRolling(const StepStore& store);

/// Names links that the plant has elsewhere than the model.
Causes ExplainGeometry(const StepStore& store);

/// Names the shapes by which fingertips and object touch at another distance than the declared ones.
Causes ExplainContacts(const StepStore& store);

/// Explains what the equations of motion of the whole robot and its object leave with the plant's
/// accelerations and forces (MotionBalance), each entry over its rounding: forces and moments, other masses
/// and inertias, armature, friction and springs of joints, another gravity.
Causes ExplainForces(const StepStore& store);

struct SearchOptions {
  /// Processor time that the search for causes may take, s: what was found until then stands. Most faults
  /// take tenths of a second, some minutes.
  double seconds = 3.0;
  /// Whether terms of the model differ from the engine's at one and the same state.
  bool model_fails = false;
};

/// All: measurement, actuation, law, contact, geometry, rolling, balance. Forces that follow from links in
/// other places, or from another model, are not explained. What no robot like this one can have is listed as
/// not explained.
/// @param void_from of FindVoid, s: how wheels roll is explained up to then.
/// @param stopped whether the search ended before it was done, by its limit or by the user.
Causes ExplainRun(const StepStore& store, double void_from, const SearchOptions& options = {},
                  bool* stopped = nullptr);

}  // namespace dexcheck
