#pragma once

#include <memory>

#include "controller/contact/surface.h"
#include "controller/model/rigid_body.h"

namespace dexcheck {

/// The surface of a solid, in the solid's frame: of a sphere, a cylinder (its side, unbounded), an ellipsoid,
/// a torus or a box, over whose edges no contact rolls.
/// @throws std::invalid_argument for a capsule, whose surface has jumps of curvature that (40) cannot cross.
std::unique_ptr<Surface> MakeSurface(const Shape& shape);

/// The point of a surface that two angles (rad) name in a scenario: its coordinates in chart 0, but of a box
/// longitude u and latitude v of the ray from the centre that leaves the box there.
SurfacePoint PointAtAngles(const Surface& surface, double u, double v);
/// The angles (rad) of a point.
Vector2d AnglesOfPoint(const Surface& surface, const SurfacePoint& point);

}  // namespace dexcheck
