#pragma once

#include <mujoco/mujoco.h>

#include <cstddef>
#include <functional>
#include <span>
#include <utility>

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

/// A copy of a compiled model whose arrays have more rows or fewer.
/// @param resize changes sizes of the model (npair, ngeom) that it is given. Rows that are dropped are the
/// last ones; new ones come last and are zero.
MjModelPtr MakeResizedCopy(const mjModel& model, const std::function<void(mjModel*)>& resize);

/// A copy of a compiled model in which these geoms touch as well, as if the MJCF had a <pair> of three
/// dimensions for each: sliding friction is the larger one of the two geoms', as the engine mixes it, and
/// stiffness the default's.
/// @throws InputError when the model lets geoms touch by contype and conaffinity, whose order the engine
/// needs.
MjModelPtr AddContactPairs(const mjModel& model, std::span<const std::pair<int, int>> geoms);

/// The model as it is to be drawn, and for that only. Where something that moves can be seen it stays what it
/// is. Where all shapes that move are in groups that the engine hides, they are shown. A robot that has no
/// shapes, or on less than half of its links, as descriptions made for dynamics often have none, gets rods
/// from each body to those that hang on it, to its sites, and to the centre of mass of the last ones, and
/// balls at its joints. A model without lights gets a brighter headlight. Bodies, joints and sites keep their
/// numbers.
MjModelPtr MakeVisible(MjModelPtr model);

}  // namespace dexcheck
