#pragma once

#include <memory>

#include "controller/contact/surface.h"
#include "controller/model/rigid_body.h"

namespace dexcheck {

/// The smooth surface of a solid, in the solid's frame: of a sphere, a cylinder (its side, unbounded) or a
/// torus.
/// @throws std::invalid_argument for a box or a capsule, whose surfaces have edges or jumps of curvature that
/// (40) cannot cross.
std::unique_ptr<Surface> MakeSurface(const Shape& shape);

}  // namespace dexcheck
