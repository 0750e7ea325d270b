#include "controller/contact/object_surface.h"

#include <stdexcept>

#include "controller/contact/shapes.h"

namespace dexcheck {
namespace {

struct SurfaceMaker {
  std::unique_ptr<Surface> operator()(const SolidSphere& sphere) const {
    return std::make_unique<Sphere>(sphere.radius);
  }
  std::unique_ptr<Surface> operator()(const SolidCylinder& cylinder) const {
    return std::make_unique<Cylinder>(cylinder.radius);
  }
  std::unique_ptr<Surface> operator()(const SolidTorus& torus) const {
    return std::make_unique<Torus>(torus.ring_radius, torus.tube_radius);
  }
  std::unique_ptr<Surface> operator()(const SolidBox&) const { throw std::invalid_argument(kNotSmooth); }
  std::unique_ptr<Surface> operator()(const SolidCapsule&) const { throw std::invalid_argument(kNotSmooth); }

  static constexpr const char* kNotSmooth =
      "object shape: must be a sphere, a cylinder or a torus for contact terms";
};

}  // namespace

std::unique_ptr<Surface> MakeSurface(const Shape& shape) { return std::visit(SurfaceMaker{}, shape); }

}  // namespace dexcheck
