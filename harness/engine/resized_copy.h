#pragma once

#include <functional>

#include "harness/engine/engine.h"

namespace dexcheck {

/// A copy of a compiled model whose arrays have more rows.
/// @param enlarge raises sizes of the model (npair, ngeom) that it is given. New rows come last and are zero.
MjModelPtr MakeResizedCopy(const mjModel& model, const std::function<void(mjModel*)>& enlarge);

}  // namespace dexcheck
