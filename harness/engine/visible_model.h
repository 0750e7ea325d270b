#pragma once

#include "harness/engine/engine.h"
#include "harness/engine/mjcf_file.h"

namespace dexcheck {

/// Loads an MJCF for drawing only. A model whose moving parts can be seen stays as it is. Where all shapes
/// that move are in groups that the engine hides, they are shown. A robot with shapes on less than half of
/// its links, as in descriptions made for dynamics, gets rods from each body to the bodies that hang on it,
/// to its sites, and to the centre of mass of the last ones, and balls at its joints. A model without lights
/// gets a brighter headlight. Bodies, joints and sites keep their numbers.
/// @param mjcf gets the rods and balls. @throws InputError as LoadMjcf.
MjModelPtr LoadVisible(MjcfFile* mjcf);

}  // namespace dexcheck
