#pragma once

#include <span>
#include <utility>

#include "harness/engine/engine.h"

namespace dexcheck {

/// A copy of a compiled model in which these geoms touch as well, as if the MJCF had a <pair> of three
/// dimensions for each: sliding friction is the larger one of the two geoms', as the engine mixes it, and
/// stiffness the default's.
/// @throws InputError when the model lets geoms touch by contype and conaffinity, whose order the engine
/// needs.
MjModelPtr AddContactPairs(const mjModel& model, std::span<const std::pair<int, int>> geoms);

}  // namespace dexcheck
