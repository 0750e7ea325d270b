#pragma once

#include "harness/engine/adapter.h"

namespace dexcheck {

/// Moments of inertia of a wheel's body, kg m^2.
struct WheelInertia {
  double spin = 0.0;        ///< About its hinge.
  double transverse = 0.0;  ///< Mean of those square to it.
};

WheelInertia CalcWheelInertia(const mjModel& engine, const EngineWheel& wheel);

}  // namespace dexcheck
