#pragma once

#include <mujoco/mujoco.h>

#include <cstddef>
#include <span>

#include "harness/engine/engine.h"

namespace dexcheck {

/// Removes from a compiled model the geoms that are only looked at: those that cannot touch anything and that
/// no tendon, sensor, equality, tuple or fluid force refers to. The engine places every geom in every step,
/// so that a robot with fine looks costs more to simulate; without them it moves bit for bit the same.
/// Bodies, joints and sites keep their numbers, the geoms that stay get new ones in the old order. Draw
/// another model of the same file.
/// @param wanted geoms that stay besides. @return the number of geoms removed.
int RemoveLooks(MjModelPtr* model, std::span<const int> wanted = {});

/// Removes the pictures on a compiled model's surfaces, most of its bytes, which only drawing reads. A robot
/// that is copied for each of many runs then costs less to copy. @return the bytes removed.
size_t RemovePictures(MjModelPtr* model);

}  // namespace dexcheck
