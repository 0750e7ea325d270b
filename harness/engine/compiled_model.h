#pragma once

#include <mujoco/mujoco.h>

#include <cstddef>
#include <functional>
#include <span>
#include <utility>

#include "harness/engine/engine.h"

namespace dexcheck {

/// Removes the geoms of a compiled model that are only looked at: those that cannot touch anything and that
/// no tendon, sensor, equality, tuple or fluid force refers to. The engine places every geom in every step,
/// so that a robot with many visual geoms costs more to simulate; without them its motion is bit for bit the
/// same. Bodies, joints and sites keep their numbers, the remaining geoms get new ones in the old order. Draw
/// another model of the same file.
/// @param wanted geoms that stay as well. @return the number of geoms removed.
int RemoveLooks(MjModelPtr* model, std::span<const int> wanted = {});

/// Removes the textures of a compiled model, most of its bytes, which only drawing reads. A robot that is
/// copied for many runs then costs less to copy. @return the bytes removed.
size_t RemovePictures(MjModelPtr* model);

/// Returns a copy of a compiled model whose arrays have more or fewer rows.
/// @param resize changes the sizes (npair, ngeom) of the model that it is given. The last rows are dropped;
/// new rows come last and are zero.
MjModelPtr MakeResizedCopy(const mjModel& model, const std::function<void(mjModel*)>& resize);

/// Returns a copy of a compiled model in which these geoms touch as well, as if the MJCF had a `pair` of
/// three dimensions for each: sliding friction is the larger one of the two geoms', as the engine mixes it,
/// and stiffness the default's.
/// @throws InputError when the model lets geoms touch by contype and conaffinity, whose order counts.
MjModelPtr AddContactPairs(const mjModel& model, std::span<const std::pair<int, int>> geoms);

/// Returns the model for drawing only. A model whose moving parts can be seen stays as it is. Where all
/// shapes that move are in groups that the engine hides, they are shown. A robot with shapes on less than
/// half of its links, as in descriptions made for dynamics, gets rods from each body to the bodies that hang
/// on it, to its sites, and to the centre of mass of the last ones, and balls at its joints. A model without
/// lights gets a brighter headlight. Bodies, joints and sites keep their numbers.
MjModelPtr MakeVisible(MjModelPtr model);

}  // namespace dexcheck
