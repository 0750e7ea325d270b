#pragma once

#include <mujoco/mujoco.h>

#include <vector>

#include "renders/decoration.h"
#include "renders/overlay.h"
#include "renders/run_frames.h"

namespace dexcheck {

/// The contact forces of a row, each in its friction cone.
/// @param meters_per_newton as CalcMetersPerNewton has it.
std::vector<Decoration> MakeForces(const RunFrames& run, long row, double meters_per_newton);

/// The key to their colours.
std::vector<LegendEntry> MakeForceLegend(const RunFrames& run);

/// How long the arrow of 1 N is drawn: the run's largest contact force fits beside a hand. 1 when there is
/// none.
double CalcMetersPerNewton(const RunFrames& run);

/// Puts a row of a run into `data` and computes what drawing needs.
void SetRow(const mjModel& model, const RunFrames& run, long row, mjData* data);

}  // namespace dexcheck
