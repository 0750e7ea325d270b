#pragma once

// Decorations: shapes drawn into the scene besides the model's own geoms. Points in world coordinates, m.

#include <array>
#include <variant>
#include <vector>

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

/// A path, drawn as a tube.
struct Polyline {
  std::vector<Vector3d> points;
  double radius;  ///< m.
  Color color;
};

struct Dot {
  Vector3d center;
  double radius;  ///< m.
  Color color;
};

using Decoration = std::variant<Arrow, Cone, Polyline, Dot>;

}  // namespace dexcheck
