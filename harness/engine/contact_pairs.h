#pragma once

#include <filesystem>
#include <span>
#include <utility>

#include "harness/engine/engine.h"

namespace dexcheck {

/// Returns a copy of a compiled model in which these geoms touch as well, as if the MJCF had a `pair` of
/// three dimensions for each: sliding friction is the larger one of the two geoms', as the engine mixes it,
/// and stiffness the default's.
/// @param model of the MJCF; its numbers may have been changed since.
/// @throws InputError when the model lets geoms touch by contype and conaffinity, whose order counts.
MjModelPtr AddContactPairs(const mjModel& model, std::span<const std::pair<int, int>> geoms,
                           const std::filesystem::path& mjcf);

}  // namespace dexcheck
