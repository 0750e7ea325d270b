#pragma once

namespace dexcheck {

/// How the rigid plant steps.
enum class Integrator {
  kRungeKutta4,  ///< Four evaluations, fourth order for the torques given; velocities and positions of one
                 ///< time.
  /// One evaluation: new velocities, then positions by them. Velocities belong to the middle of the step
  /// before, as the engine's.
  kSemiImplicitEuler,
};

}  // namespace dexcheck
