#pragma once

#include <functional>

#include "harness/engine/engine.h"

namespace dexcheck {

/// A copy of a compiled model whose arrays have more rows or fewer.
/// @param resize changes sizes of the model (npair, ngeom) that it is given. Rows that are dropped are the
/// last ones; new ones come last and are zero.
MjModelPtr MakeResizedCopy(const mjModel& model, const std::function<void(mjModel*)>& resize);

}  // namespace dexcheck
