// Time per contact of the contact terms of one control step.

#include <benchmark/benchmark.h>

#include "controller/contact/contact_geometry.h"
#include "controller/contact/grasp_map.h"
#include "controller/contact/shapes.h"

namespace dexcheck {
namespace {

const ContactCoordinates kKappa = {{0.4, 0.5, 0}, {0.8, 0.3, 0}, 0.6};

template <typename SurfaceType>
void EvaluateSurface(benchmark::State& state, const SurfaceType& surface) {
  SurfacePoint alpha = {0.4, 0.3, 0};
  for (auto _ : state) {
    alpha.u += 1e-9;
    benchmark::DoNotOptimize(surface.Evaluate(alpha));
  }
}
BENCHMARK_CAPTURE(EvaluateSurface, sphere, Sphere(0.009));
BENCHMARK_CAPTURE(EvaluateSurface, torus, Torus(0.035, 0.011));
BENCHMARK_CAPTURE(EvaluateSurface, ellipsoid, Ellipsoid({0.05, 0.03, 0.02}));

void ProjectOnEllipsoid(benchmark::State& state) {
  const Ellipsoid ellipsoid({0.05, 0.03, 0.02});
  Vector3d p(0.04, 0.02, 0.015);
  for (auto _ : state) {
    p.x() += 1e-12;
    benchmark::DoNotOptimize(ellipsoid.Project(p));
  }
}
BENCHMARK(ProjectOnEllipsoid);

// Sphere on torus: geometry, kappa_dot, three rows of G, G_dot, J_B' and J_B_dot' over 50 coordinates.
void ContactTerms(benchmark::State& state) {
  const Sphere tip(0.009);
  const Torus torus(0.035, 0.011);
  const Matrix6Xd J_f = Matrix6Xd::Random(6, 50);
  const Vector6d V = Vector6d::Random();
  Contact contact;
  Matrix6Xd G(6, 3);
  Matrix6Xd G_dot(6, 3);
  MatrixXd J_B(3, 50);
  MatrixXd J_B_dot(3, 50);
  for (auto _ : state) {
    contact.geometry = CalcContactGeometry(tip, torus, kKappa);
    contact.kappa_dot =
        CalcKappaDot(contact.geometry, CalcRelativeTwist(contact.geometry, V, Vector6d::Zero()));
    CalcGraspMap({&contact, 1}, G);
    CalcGraspMapDot({&contact, 1}, G_dot);
    CalcContactJacobian(contact, J_f, J_B);
    CalcContactJacobianDot(contact, J_f, J_f, J_B_dot);
    benchmark::ClobberMemory();
  }
}
BENCHMARK(ContactTerms);

void GeometryAndKappaDot(benchmark::State& state) {
  const Sphere tip(0.009);
  const Torus torus(0.035, 0.011);
  const Vector6d V = Vector6d::Random();
  ContactCoordinates kappa = kKappa;
  for (auto _ : state) {
    kappa.psi += 1e-12;
    benchmark::DoNotOptimize(CalcKappaDot(CalcContactGeometry(tip, torus, kappa), V));
  }
}
BENCHMARK(GeometryAndKappaDot);

void IntegrateOneStep(benchmark::State& state) {
  const Sphere tip(0.009);
  const Torus torus(0.035, 0.011);
  const Vector6d V = Vector6d::Random();
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        IntegrateKappa(tip, torus, kKappa, 0.0, 1e-3, [&](double, const ContactGeometry&) { return V; }));
  }
}
BENCHMARK(IntegrateOneStep);

void FindContactFromGuess(benchmark::State& state) {
  const Sphere tip(0.009);
  const Torus torus(0.035, 0.011);
  const ContactGeometry contact = CalcContactGeometry(tip, torus, kKappa);
  const Pose X_OF = contact.g_o_cf * contact.g_f_cf.inverse();
  ContactCoordinates guess = kKappa;
  guess.alpha_f.u += 1e-4;
  guess.alpha_o.v += 1e-4;
  for (auto _ : state) benchmark::DoNotOptimize(FindContact(tip, torus, X_OF, guess));
}
BENCHMARK(FindContactFromGuess);

}  // namespace
}  // namespace dexcheck

BENCHMARK_MAIN();
