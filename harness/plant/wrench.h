#pragma once

#include "controller/common/types.h"

namespace dexcheck {

/// A force and a torque that act on one body, in world axes.
struct Wrench {
  static constexpr int kObject = -2;
  int body = kObject;                  ///< Index of the joint that moves the link; -1 is the base.
  Vector3d point = Vector3d::Zero();   ///< Where the force acts, m.
  Vector3d force = Vector3d::Zero();   ///< N.
  Vector3d torque = Vector3d::Zero();  ///< N m.
};

}  // namespace dexcheck
