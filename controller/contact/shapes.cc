#include "controller/contact/shapes.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "controller/common/errors.h"

namespace dexcheck {

namespace {

// A latitude chart serves to this latitude; beyond it the other chart is at a latitude below 0.48 rad.
constexpr double kMarginLatitude = 1.1;
// cos(v) below which a latitude chart counts as degenerate.
constexpr double kPoleCosine = 1e-9;
// Distance to a centre or an axis, relative to the radius, below which the closest point counts as not
// unique.
constexpr double kCentreTolerance = 1e-12;
// Newton's method on the ellipsoid needs about ten steps; far more means that the numbers are not finite.
constexpr int kMaxNewtonSteps = 100;

double WrapAngle(double angle) { return std::remainder(angle, 2.0 * kPi); }

void RequireUnique(double distance, double scale, const char* what) {
  if (distance > kCentreTolerance * scale) return;
  throw SingularityError(
      std::string("closest point is not unique, distance to ") + what + " [m]: " + std::to_string(distance),
      distance);
}

// Latitude charts of the unit sphere. Component i of the chart's own axes is body component (i + chart) mod
// 3, so chart 0 has its poles on z and chart 1 on x.
Vector3d ToBodyAxes(const Vector3d& local, int chart) {
  return chart == 0 ? local : Vector3d(local.z(), local.x(), local.y());
}

Vector3d ToChartAxes(const Vector3d& body, int chart) {
  return chart == 0 ? body : Vector3d(body.y(), body.z(), body.x());
}

Vector3d CalcUnitSpherePoint(const SurfacePoint& alpha) {
  const double cos_v = std::cos(alpha.v);
  return ToBodyAxes({cos_v * std::cos(alpha.u), cos_v * std::sin(alpha.u), std::sin(alpha.v)}, alpha.chart);
}

SurfacePoint CalcLatitudeCoordinates(const Vector3d& direction, int chart) {
  const Vector3d local = ToChartAxes(direction, chart);
  return {std::atan2(local.y(), local.x()), std::atan2(local.z(), std::hypot(local.x(), local.y())), chart};
}

bool HasLatitudeMargin(const SurfacePoint& alpha) { return std::abs(alpha.v) <= kMarginLatitude; }

// The first chart that holds the direction away from its poles.
SurfacePoint CalcBestLatitudeCoordinates(const Vector3d& direction) {
  const SurfacePoint first = CalcLatitudeCoordinates(direction, 0);
  return HasLatitudeMargin(first) ? first : CalcLatitudeCoordinates(direction, 1);
}

// A face of a box: its normal's axis and side, and the axes of u and v, of which c_u x c_v points outwards.
struct Face {
  int axis, u, v;
  double side;
};

Face FaceOf(int chart) {
  const int axis = chart / 2;
  const int next = (axis + 1) % 3;
  const int last = (axis + 2) % 3;
  return chart % 2 == 0 ? Face{axis, next, last, 1.0} : Face{axis, last, next, -1.0};
}

// The point of a face that is u and v from its middle.
Vector3d PlaceOnFace(const Face& face, const Vector3d& half_size, double u, double v) {
  Vector3d p;
  p[face.axis] = face.side * half_size[face.axis];
  p[face.u] = u;
  p[face.v] = v;
  return p;
}

// How far rounding may carry a contact beyond an edge, relative to the face.
constexpr double kEdgeRounding = 1e-9;

struct SurfaceMaker {
  using Made = std::unique_ptr<Surface>;
  Made operator()(const SolidSphere& solid) const { return std::make_unique<Sphere>(solid.radius); }
  Made operator()(const SolidCylinder& solid) const { return std::make_unique<Cylinder>(solid.radius); }
  Made operator()(const SolidTorus& solid) const {
    return std::make_unique<Torus>(solid.ring_radius, solid.tube_radius);
  }
  Made operator()(const SolidBox& solid) const { return std::make_unique<Box>(0.5 * solid.size); }
  Made operator()(const SolidEllipsoid& solid) const { return std::make_unique<Ellipsoid>(solid.semi_axes); }
  Made operator()(const SolidCapsule&) const {
    throw std::invalid_argument(
        "object shape: must be a sphere, a cylinder, an ellipsoid, a box or a torus for contact terms");
  }
};

}  // namespace

SurfaceProjection Plane::Project(const Vector3d& p) const { return {{p.x(), p.y(), 0}, p.z()}; }

SurfaceJet Plane::DoCalcJet(const SurfacePoint& alpha) const {
  return {.c = {alpha.u, alpha.v, 0.0}, .c_u = Vector3d::UnitX(), .c_v = Vector3d::UnitY()};
}

SurfacePoint Plane::DoToChart(const SurfacePoint& alpha, int /*chart*/) const { return alpha; }

Cylinder::Cylinder(double radius) : radius_(radius) { RequirePositive(radius, "cylinder radius [m]"); }

SurfaceProjection Cylinder::Project(const Vector3d& p) const {
  const double axis_distance = std::hypot(p.x(), p.y());
  RequireUnique(axis_distance, radius_, "the cylinder's axis");
  return {{std::atan2(p.y(), p.x()), p.z(), 0}, axis_distance - radius_};
}

SurfaceJet Cylinder::DoCalcJet(const SurfacePoint& alpha) const {
  const double cu = std::cos(alpha.u);
  const double su = std::sin(alpha.u);
  return {.c = {radius_ * cu, radius_ * su, alpha.v},
          .c_u = {-radius_ * su, radius_ * cu, 0.0},
          .c_v = Vector3d::UnitZ(),
          .c_uu = {-radius_ * cu, -radius_ * su, 0.0}};
}

SurfacePoint Cylinder::DoToChart(const SurfacePoint& alpha, int chart) const {
  return {WrapAngle(alpha.u), alpha.v, chart};
}

Ellipsoid::Ellipsoid(const Vector3d& semi_axes, const char* name) : semi_axes_(semi_axes) {
  for (const double semi_axis : semi_axes) RequirePositive(semi_axis, name);
}

SurfaceJet Ellipsoid::DoCalcJet(const SurfacePoint& alpha) const {
  // c = D s(u, v) with s on the unit sphere and D = diag(semi_axes)
  const double cu = std::cos(alpha.u);
  const double su = std::sin(alpha.u);
  const double cv = std::cos(alpha.v);
  const double sv = std::sin(alpha.v);
  if (!(cv > kPoleCosine)) {
    throw SingularityError("latitude v is at or beyond the chart's pole [rad]: " + std::to_string(alpha.v),
                           alpha.v);
  }
  const auto scale = [&](double x, double y, double z) -> Vector3d {
    return semi_axes_.cwiseProduct(ToBodyAxes({x, y, z}, alpha.chart));
  };
  return {.c = scale(cv * cu, cv * su, sv),
          .c_u = scale(-cv * su, cv * cu, 0.0),
          .c_v = scale(-sv * cu, -sv * su, cv),
          .c_uu = scale(-cv * cu, -cv * su, 0.0),
          .c_uv = scale(sv * su, -sv * cu, 0.0),
          .c_vv = scale(-cv * cu, -cv * su, -sv)};
}

SurfacePoint Ellipsoid::DoToChart(const SurfacePoint& alpha, int chart) const {
  if (chart == alpha.chart && std::abs(alpha.v) <= kPi / 2.0) return {WrapAngle(alpha.u), alpha.v, chart};
  return CalcLatitudeCoordinates(CalcUnitSpherePoint(alpha), chart);
}

bool Ellipsoid::DoHasMargin(const SurfacePoint& alpha) const { return HasLatitudeMargin(alpha); }

SurfaceProjection Sphere::Project(const Vector3d& p) const {
  const double centre_distance = p.norm();
  RequireUnique(centre_distance, radius(), "the sphere's centre");
  return {CalcBestLatitudeCoordinates(p), centre_distance - radius()};
}

SurfaceProjection Ellipsoid::Project(const Vector3d& p) const {
  // The closest point is x_i = a_i^2 p_i / (a_i^2 + t) with sum (x_i / a_i)^2 = 1, t the largest root. In
  // s = t + a_min^2 and d_i = a_i^2 - a_min^2 the unit vector e_i = x_i / a_i = a_i p_i / (s + d_i) must
  // satisfy
  //   g(s) = sum e_i^2 - 1 = 0,  s > 0.
  // g is convex and falls, so Newton's method from a point with g >= 0 rises monotonically to the root.
  const double a_min = semi_axes_.minCoeff();
  const Vector3d numerator = semi_axes_.cwiseProduct(p);
  const Vector3d d = semi_axes_.array().square() - a_min * a_min;
  const auto calc_e = [&](double s) {
    Vector3d e;
    for (int i = 0; i < 3; ++i) e(i) = numerator(i) == 0.0 ? 0.0 : numerator(i) / (s + d(i));
    return e;
  };

  // Each candidate makes one e_i^2 equal to 1, hence g >= 0.
  double s = std::max(0.0, (numerator.cwiseAbs() - d).maxCoeff());
  Vector3d e = calc_e(s);
  if (!(s > 0.0) && !(e.squaredNorm() >= 1.0)) {
    throw SingularityError("closest point of the ellipsoid is not unique, distance to its centre [m]: " +
                               std::to_string(p.norm()),
                           p.norm());
  }
  for (int step = 0; step < kMaxNewtonSteps; ++step) {
    double slope = 0.0;
    for (int i = 0; i < 3; ++i) slope += e(i) == 0.0 ? 0.0 : 2.0 * e(i) * e(i) / (s + d(i));
    const double s_next = s + (e.squaredNorm() - 1.0) / slope;
    if (!(s_next > s)) break;
    s = s_next;
    e = calc_e(s);
  }
  e.normalize();
  // signed distance = n . (p - x), with the outward normal n along D^-1 e
  const Vector3d n = e.cwiseQuotient(semi_axes_).normalized();
  return {CalcBestLatitudeCoordinates(e), n.dot(p - semi_axes_.cwiseProduct(e))};
}

Box::Box(const Vector3d& half_size) : half_size_(half_size) {
  for (const double half : half_size) RequirePositive(half, "box half length [m]");
}

SurfaceProjection Box::Project(const Vector3d& p) const {
  const Vector3d beyond = p.cwiseAbs() - half_size_;
  Eigen::Index axis = 0;
  beyond.maxCoeff(&axis);
  const int chart = static_cast<int>(2 * axis) + (p[axis] < 0.0 ? 1 : 0);
  const Face face = FaceOf(chart);
  const auto clamp = [&](int i) { return std::clamp(p[i], -half_size_[i], half_size_[i]); };
  const double outside = beyond.cwiseMax(0.0).norm();
  return {{clamp(face.u), clamp(face.v), chart}, outside > 0.0 ? outside : beyond[axis]};
}

bool Box::Contains(const SurfacePoint& alpha, double margin) const {
  const Face face = FaceOf(alpha.chart);
  return std::abs(alpha.u) + margin <= half_size_[face.u] && std::abs(alpha.v) + margin <= half_size_[face.v];
}

SurfaceJet Box::DoCalcJet(const SurfacePoint& alpha) const {
  const Face face = FaceOf(alpha.chart);
  const double over =
      std::max(std::abs(alpha.u) / half_size_[face.u], std::abs(alpha.v) / half_size_[face.v]);
  if (over > 1.0 + kEdgeRounding) {
    throw SingularityError("contact is beyond the edge of the box's face " + std::to_string(alpha.chart) +
                               ", at (u, v) [m]: " + std::to_string(alpha.u) + ", " + std::to_string(alpha.v),
                           over);
  }
  return {.c = PlaceOnFace(face, half_size_, alpha.u, alpha.v),
          .c_u = Vector3d::Unit(face.u),
          .c_v = Vector3d::Unit(face.v)};
}

SurfacePoint Box::DoToChart(const SurfacePoint& alpha, int chart) const {
  if (chart == alpha.chart) return alpha;
  const Vector3d p = PlaceOnFace(FaceOf(alpha.chart), half_size_, alpha.u, alpha.v);
  const Face to = FaceOf(chart);
  const auto clamp = [&](int i) { return std::clamp(p[i], -half_size_[i], half_size_[i]); };
  return {clamp(to.u), clamp(to.v), chart};
}

Torus::Torus(double ring_radius, double tube_radius) : ring_radius_(ring_radius), tube_radius_(tube_radius) {
  RequirePositive(tube_radius, "torus tube radius [m]");
  Require(std::isfinite(ring_radius) && ring_radius > tube_radius, "torus ring radius [m]",
          "must exceed the tube radius", ring_radius);
}

SurfaceProjection Torus::Project(const Vector3d& p) const {
  const double axis_distance = std::hypot(p.x(), p.y());
  RequireUnique(axis_distance, ring_radius_, "the torus's axis");
  const double core_distance = std::hypot(axis_distance - ring_radius_, p.z());
  RequireUnique(core_distance, tube_radius_, "the torus's core circle");
  return {{std::atan2(p.y(), p.x()), std::atan2(p.z(), axis_distance - ring_radius_), 0},
          core_distance - tube_radius_};
}

SurfaceJet Torus::DoCalcJet(const SurfacePoint& alpha) const {
  const double cu = std::cos(alpha.u);
  const double su = std::sin(alpha.u);
  const double r_cv = tube_radius_ * std::cos(alpha.v);
  const double r_sv = tube_radius_ * std::sin(alpha.v);
  const double rho = ring_radius_ + r_cv;
  return {.c = {rho * cu, rho * su, r_sv},
          .c_u = {-rho * su, rho * cu, 0.0},
          .c_v = {-r_sv * cu, -r_sv * su, r_cv},
          .c_uu = {-rho * cu, -rho * su, 0.0},
          .c_uv = {r_sv * su, -r_sv * cu, 0.0},
          .c_vv = {-r_cv * cu, -r_cv * su, -r_sv}};
}

SurfacePoint Torus::DoToChart(const SurfacePoint& alpha, int chart) const {
  return {WrapAngle(alpha.u), WrapAngle(alpha.v), chart};
}

std::unique_ptr<Surface> MakeSurface(const Shape& shape) { return std::visit(SurfaceMaker{}, shape); }

SurfacePoint PointAtAngles(const Surface& surface, double u, double v) {
  const auto* box = dynamic_cast<const Box*>(&surface);
  if (box == nullptr) return {u, v, 0};
  const Vector3d ray(std::cos(v) * std::cos(u), std::cos(v) * std::sin(u), std::sin(v));
  return box->Project(ray / ray.cwiseAbs().cwiseQuotient(box->half_size()).maxCoeff()).alpha;
}

}  // namespace dexcheck
