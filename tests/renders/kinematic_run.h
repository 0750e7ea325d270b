#pragma once

#include <mujoco/mujoco.h>

#include "renders/image.h"
#include "renders/viewpoint.h"

namespace dexcheck::testing {

/// A run that no simulation made, for tests of drawing: the robot in keyframe grasp_ready slides along x at 1
/// m/s with the torus in its hand. Contacts are where the fingertips touch the torus; errors and residuals
/// are smooth inventions.
/// @param model the shipped scene.
RunFrames MakeKinematicRun(const mjModel& model, double duration, double step = 0.01);

/// Location of the torus in a picture: the mean of its orange pixels, and how many there are.
Vector3d FindTorus(const Image& image);

}  // namespace dexcheck::testing
