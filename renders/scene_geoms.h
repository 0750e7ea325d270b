#pragma once

#include <mujoco/mujoco.h>

#include <span>

#include "renders/decoration.h"
#include "renders/display_meshes.h"

namespace dexcheck {

/// Adds decorations to a scene.
/// @param meshes gets the shapes that the engine does not have, which must outlive the drawing of the scene.
/// @throws std::invalid_argument when the scene has no room for them.
void AddDecorations(std::span<const Decoration> decorations, DisplayMeshes* meshes, mjvScene* scene);

}  // namespace dexcheck
