#pragma once

#include "harness/engine/engine.h"

namespace dexcheck {

/// The model as it is to be drawn, and for that only. Where something that moves can be seen it stays what it
/// is. Where all shapes that move are in groups that the engine hides, they are shown. A robot that has no
/// shapes, as descriptions made for dynamics often have none, gets rods from each body to those that hang on
/// it, to its sites, and to the centre of mass of the last ones, and balls at its joints. A model without
/// lights gets a brighter headlight. Bodies, joints and sites keep their numbers.
MjModelPtr MakeVisible(MjModelPtr model);

}  // namespace dexcheck
