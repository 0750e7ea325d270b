#pragma once

// Decorations: shapes drawn into the scene besides the model's own geoms. Points in world coordinates, m.

#include <array>
#include <variant>

#include "controller/common/types.h"

namespace dexcheck {

/// Red, green, blue, opacity, each from 0 to 1.
using Color = std::array<float, 4>;

/// A force or another vector.
struct Arrow {
  Vector3d from;
  Vector3d to;
  double radius;  ///< Of the shaft, m.
  Color color;
};

/// The forces that Coulomb friction allows: a cone that opens from its apex along its axis.
struct Cone {
  Vector3d apex;
  Vector3d axis;      ///< Unit vector.
  double height;      ///< m.
  double half_angle;  ///< rad, atan(mu).
  Color color;
};

using Decoration = std::variant<Arrow, Cone>;

}  // namespace dexcheck
