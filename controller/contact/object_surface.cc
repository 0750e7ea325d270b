#include "controller/contact/object_surface.h"

#include <cmath>
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
  std::unique_ptr<Surface> operator()(const SolidBox& box) const {
    return std::make_unique<Box>(0.5 * box.size);
  }
  std::unique_ptr<Surface> operator()(const SolidEllipsoid& ellipsoid) const {
    return std::make_unique<Ellipsoid>(ellipsoid.semi_axes);
  }
  std::unique_ptr<Surface> operator()(const SolidCapsule&) const { throw std::invalid_argument(kNotSmooth); }

  static constexpr const char* kNotSmooth =
      "object shape: must be a sphere, a cylinder, an ellipsoid, a box or a torus for contact terms";
};

}  // namespace

std::unique_ptr<Surface> MakeSurface(const Shape& shape) { return std::visit(SurfaceMaker{}, shape); }

SurfacePoint PointAtAngles(const Surface& surface, double u, double v) {
  const auto* box = dynamic_cast<const Box*>(&surface);
  if (box == nullptr) return {u, v, 0};
  const Vector3d ray(std::cos(v) * std::cos(u), std::cos(v) * std::sin(u), std::sin(v));
  return box->Project(ray / ray.cwiseAbs().cwiseQuotient(box->half_size()).maxCoeff()).alpha;
}

Vector2d AnglesOfPoint(const Surface& surface, const SurfacePoint& point) {
  if (dynamic_cast<const Box*>(&surface) == nullptr) {
    const SurfacePoint first = surface.ToChart(point, 0);
    return {first.u, first.v};
  }
  const Vector3d p = surface.Evaluate(point).p;
  return {std::atan2(p.y(), p.x()), std::atan2(p.z(), p.head<2>().norm())};
}

}  // namespace dexcheck
