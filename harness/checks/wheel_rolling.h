#pragma once

// How wheels of a differential drive roll: r thetadot = v +- w b / 2, the right one with +, (1).

#include "controller/common/types.h"
#include "controller/model/robot_model.h"

namespace dexcheck {

/// [v; w], m/s and rad/s, of a platform that rolls. @param xi starts with the base's velocity.
Vector2d CalcRollingTwist(const Base& base, const VectorXd& xi);

/// v +- w b / 2 - r thetadot of the right and the left wheel, m/s. @param rates thetadot, rad/s.
Vector2d CalcRollingMismatch(const Base& base, const VectorXd& xi, const Vector2d& rates);

}  // namespace dexcheck
