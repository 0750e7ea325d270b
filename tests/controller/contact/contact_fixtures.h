#pragma once

// Surfaces, motions and finite differences that the contact tests share.

#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "controller/common/types.h"
#include "controller/contact/contact_geometry.h"
#include "controller/contact/shapes.h"

namespace dexcheck::testing {

/// A surface with an implicit function F that knows nothing of charts: F < 0 inside, 0 on it, > 0 outside.
struct NamedSurface {
  std::string name;
  std::shared_ptr<const Surface> surface;
  std::function<double(const Vector3d&)> F;
  double length = 0.0;  ///< typical size, m
  double max_v = 0.0;   ///< range of v to draw from
};

inline NamedSurface MakePlane() {
  return {"plane", std::make_shared<Plane>(), [](const Vector3d& p) { return p.z(); }, 0.02, 0.03};
}

inline NamedSurface MakeCylinder() {
  constexpr double kRadius = 0.03;
  return {"cylinder", std::make_shared<Cylinder>(kRadius),
          [=](const Vector3d& p) { return std::hypot(p.x(), p.y()) - kRadius; }, kRadius, 0.04};
}

inline NamedSurface MakeSphere(double radius = 0.02) {
  return {"sphere", std::make_shared<Sphere>(radius), [=](const Vector3d& p) { return p.norm() - radius; },
          radius, 1.4};
}

inline NamedSurface MakeEllipsoid(const Vector3d& semi_axes = {0.05, 0.03, 0.02}) {
  return {"ellipsoid", std::make_shared<Ellipsoid>(semi_axes),
          [=](const Vector3d& p) { return semi_axes.minCoeff() * (p.cwiseQuotient(semi_axes).norm() - 1.0); },
          semi_axes.minCoeff(), 1.4};
}

inline NamedSurface MakeTorus(double ring_radius = 0.035, double tube_radius = 0.011) {
  return {"torus", std::make_shared<Torus>(ring_radius, tube_radius),
          [=](const Vector3d& p) {
            return std::hypot(std::hypot(p.x(), p.y()) - ring_radius, p.z()) - tube_radius;
          },
          tube_radius, 3.1};
}

inline std::vector<NamedSurface> MakeAllSurfaces() {
  return {MakePlane(), MakeCylinder(), MakeSphere(), MakeEllipsoid(), MakeTorus()};
}

inline double DrawUniform(std::mt19937& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

inline VectorXd DrawVector(std::mt19937& random, Eigen::Index size) {
  VectorXd v(size);
  for (double& entry : v) entry = DrawUniform(random, -1.0, 1.0);
  return v;
}

inline SurfacePoint DrawPoint(std::mt19937& random, const NamedSurface& named, int chart) {
  const double max_u = named.name == "plane" ? named.max_v : 3.1;
  return {DrawUniform(random, -max_u, max_u), DrawUniform(random, -named.max_v, named.max_v), chart};
}

/// Rigid motion with constant body twist V = [v; omega] (m/s, rad/s) for time t (s): exp(V t).
inline Pose CalcScrewMotion(const Vector6d& V, double t) {
  const Vector3d omega = V.tail<3>();
  const double rate = omega.norm();
  Pose g = Pose::Identity();
  if (rate == 0.0) {
    g.translation() = V.head<3>() * t;
    return g;
  }
  const Vector3d axis = omega / rate;
  const double angle = rate * t;
  g.linear() = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  const Matrix3d S = Skew(axis);
  g.translation() =
      (angle * Matrix3d::Identity() + (1.0 - std::cos(angle)) * S + (angle - std::sin(angle)) * S * S) *
      V.head<3>() / rate;
  return g;
}

/// Step of the five-point difference below, s. With motions of a few rad/s its error h^4 f^(5) / 30 and the
/// rounding error eps / h both stay below 1e-11 of the signal.
inline constexpr double kStep = 1e-3;

/// df/dt at t for any f with values in a vector space, error O(kStep^4).
template <typename Function>
MatrixXd Differentiate(const Function& f, double t = 0.0, double h = kStep) {
  const MatrixXd outer = MatrixXd(f(t + 2.0 * h)) - MatrixXd(f(t - 2.0 * h));
  const MatrixXd inner = MatrixXd(f(t + h)) - MatrixXd(f(t - h));
  return (8.0 * inner - outer) / (12.0 * h);
}

/// Body twist [v; omega] of a pose function of time, by differences.
template <typename PoseFunction>
Vector6d DifferentiatePose(const PoseFunction& g, double t = 0.0) {
  const MatrixXd g_dot = Differentiate([&](double time) { return MatrixXd(g(time).matrix()); }, t);
  const Matrix3d R = g(t).linear();
  const Matrix3d omega_cross = R.transpose() * g_dot.topLeftCorner<3, 3>();
  Vector6d V;
  V << R.transpose() * g_dot.topRightCorner<3, 1>(), omega_cross(2, 1), omega_cross(0, 2), omega_cross(1, 0);
  return V;
}

/// Pose of the fingertip in the object frame that puts the bodies in contact at kappa, `gap` (m) apart.
inline Pose CalcTouchingPose(const Surface& fingertip, const Surface& object, const ContactCoordinates& kappa,
                             double gap = 0.0) {
  const ContactGeometry contact = CalcContactGeometry(fingertip, object, kappa);
  return contact.g_o_cf * Eigen::Translation3d(0.0, 0.0, -gap) * contact.g_f_cf.inverse();
}

/// Fingertip, object, and a name for the pair.
using SurfacePair = std::pair<NamedSurface, NamedSurface>;

/// Pairs in which the fingertip fits the object everywhere; the torus is met on all its sides.
inline std::vector<SurfacePair> MakeAllPairs() {
  const NamedSurface tip = MakeSphere(0.009);
  const NamedSurface blunt_tip = MakeEllipsoid({0.008, 0.007, 0.010});
  std::vector<SurfacePair> pairs;
  for (const NamedSurface& object : MakeAllSurfaces()) {
    pairs.emplace_back(tip, object);
    pairs.emplace_back(blunt_tip, object);
  }
  return pairs;
}

}  // namespace dexcheck::testing
