#pragma once

// Data types of the terms, without a formula.

#include "controller/common/types.h"

namespace dexcheck {

/// Which velocities the terms refer to.
enum class Coordinates {
  kReduced,  ///< xi = [v; joint rates], equation (18): M_bar', C_bar', F_bar'.
  /// q_dot' = [q_v_dot; joint rates], equation (16): M, C, F. Of a floating base v stands for q_v_dot.
  kUnreduced,
};

/// Kinetic energy, potential energy (zero at the world's origin) and momenta of robot or object.
struct EnergyAndMomentum {
  double kinetic = 0.0;                         ///< J, rotors (armature) and wheel spin included.
  double potential = 0.0;                       ///< J.
  Vector3d linear_momentum = Vector3d::Zero();  ///< kg m/s, world frame.
  Vector3d angular_momentum =
      Vector3d::Zero();             ///< About the centre of mass, world axes, kg m^2/s; no rotors.
  Vector3d com = Vector3d::Zero();  ///< Centre of mass, world frame, m.
};

}  // namespace dexcheck
