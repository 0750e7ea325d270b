#pragma once

// Bodies and axes in other frames.

#include "controller/common/types.h"
#include "controller/model/rigid_body.h"

namespace dexcheck {

/// The same body in another frame A, in which its own frame B stands at X_AB.
MassProperties ExpressIn(const MassProperties& body, const Pose& X_AB);

/// A rotation that turns z into the given unit vector; axes of coordinates are only permuted.
Matrix3d MakeRotationFromZ(const Vector3d& z);

}  // namespace dexcheck
