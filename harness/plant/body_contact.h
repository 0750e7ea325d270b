#pragma once

#include "controller/common/types.h"
#include "harness/engine/engine.h"

namespace dexcheck {

/// How the engine has two bodies touch; the deepest contact when there are several.
struct BodyContact {
  bool touching = false;
  double distance = 0.0;             ///< m, negative when the bodies overlap.
  Vector3d slip = Vector3d::Zero();  ///< Tangential velocity of `body` against the other, world, m/s.
  double cone_use = 0.0;             ///< |tangential force| / (mu normal force); 1 slides.
  double cone_margin = 0.0;          ///< mu normal force - |tangential force|, N.
};

/// The contact of `body` with `other`, after the step's forces are known.
BodyContact ReadBodyContact(const mjModel& m, const mjData& d, int body, int other);

}  // namespace dexcheck
