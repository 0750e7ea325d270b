// Contact coordinates by search, through changes of chart and by integration.

#include "controller/contact/contact_geometry.h"

#include <gtest/gtest.h>

#include "controller/common/errors.h"
#include "tests/common/matrix_near.h"
#include "tests/common/throws.h"
#include "tests/controller/contact/contact_fixtures.h"

namespace dexcheck::testing::contact_geometry_test {
namespace {

constexpr int kSamples = 100;
// Newton's stopping bound, 1e-13 relative; measured 9.1e-14.
constexpr double kConverged = 9e-13;
// Rounding of a few dozen operations on numbers of order one.
constexpr double kRounding = 1e-13;

struct Placement {
  ContactCoordinates kappa;
  double gap;
  Pose X_OF;
};

// Bodies `gap` apart, or overlapping, at contact coordinates known beforehand.
Placement DrawPlacement(std::mt19937& random, const SurfacePair& pair, double max_gap) {
  const Surface& fingertip = *pair.first.surface;
  const Surface& object = *pair.second.surface;
  Placement placement;
  placement.kappa = NormalizeContact(
      fingertip, object,
      {DrawPoint(random, pair.first, 0), DrawPoint(random, pair.second, object.num_charts() - 1),
       DrawUniform(random, -3.1, 3.1)});
  placement.gap = DrawUniform(random, -0.001, max_gap);
  placement.X_OF = CalcTouchingPose(fingertip, object, placement.kappa, placement.gap);
  return placement;
}

void ExpectSameContact(const FoundContact& found, const Placement& placement, const SurfacePair& pair) {
  EXPECT_NEAR(found.gap, placement.gap, kConverged);
  const Surface& fingertip = *pair.first.surface;
  const Surface& object = *pair.second.surface;
  EXPECT_TRUE(MatrixNear(fingertip.Evaluate(found.kappa.alpha_f).p,
                         fingertip.Evaluate(placement.kappa.alpha_f).p, kConverged));
  EXPECT_TRUE(MatrixNear(object.Evaluate(found.kappa.alpha_o).p, object.Evaluate(placement.kappa.alpha_o).p,
                         kConverged));
  EXPECT_TRUE(MatrixNear(CalcTouchingPose(fingertip, object, found.kappa, found.gap).matrix(),
                         placement.X_OF.matrix(), kConverged));
}

/// Calls check(pair, placement, generator) for contacts at random of all pairs of surfaces.
template <typename Check>
void ForEachContact(unsigned seed, const Check& check) {
  std::mt19937 random(seed);
  for (const SurfacePair& pair : MakeAllPairs()) {
    SCOPED_TRACE(pair.first.name + " on " + pair.second.name);
    for (int sample = 0; sample < kSamples; ++sample) check(pair, DrawPlacement(random, pair, 0.002), random);
  }
}

TEST(FindContactTest, FindsKnownContactsWithoutAGuess) {
  ForEachContact(41, [](const SurfacePair& pair, const Placement& placement, std::mt19937& /*random*/) {
    ExpectSameContact(FindContact(*pair.first.surface, *pair.second.surface, placement.X_OF), placement,
                      pair);
  });
}

TEST(FindContactTest, FindsKnownContactsFromANearbyGuess) {
  ForEachContact(42, [](const SurfacePair& pair, const Placement& placement, std::mt19937& random) {
    Vector5d offset = 0.05 * DrawVector(random, 5);
    if (pair.second.name == "plane") offset.segment<2>(2) *= 0.01;
    if (pair.second.name == "cylinder") offset(3) *= 0.01;
    const ContactCoordinates guess = Displace(placement.kappa, offset);
    ExpectSameContact(FindContact(*pair.first.surface, *pair.second.surface, placement.X_OF, guess),
                      placement, pair);
  });
}

TEST(FindContactTest, ImpossibleInputIsAClearError) {
  const Sphere ball(0.01);
  const Plane plane;
  Pose X_OF = Pose::Identity();
  X_OF.translation() = Vector3d(0.0, 0.0, 0.012);
  const FoundContact hovering = FindContact(ball, plane, X_OF);
  EXPECT_NEAR(hovering.gap, 0.002, kConverged);
  // Parallel planes have no closest pair; a ball whose start is its far side meets the wrong normals.
  EXPECT_TRUE(Throws<SingularityError>(
      [&] {
        Pose tilted = X_OF;
        tilted.linear() = Eigen::AngleAxisd(3.0, Vector3d::UnitX()).toRotationMatrix();
        return FindContact(plane, plane, tilted, {});
      },
      "no contact found"));
  const ContactCoordinates far_side = {{0.0, kPi / 2.0 - 1e-3, 0}, {0.0, 0.0, 0}, 0.0};
  EXPECT_TRUE(
      Throws<SingularityError>([&] { return FindContact(ball, plane, X_OF, far_side); }, "no contact found"));
}

TEST(NormalizeContactTest, ChartChangesDoNotMoveTheBodies) {
  std::mt19937 random(31);
  int changes = 0;
  for (const SurfacePair& pair : MakeAllPairs()) {
    const Surface& fingertip = *pair.first.surface;
    const Surface& object = *pair.second.surface;
    SCOPED_TRACE(pair.first.name + " on " + pair.second.name);
    for (int sample = 0; sample < 50; ++sample) {
      const ContactCoordinates kappa = {DrawPoint(random, pair.first, sample % 2),
                                        DrawPoint(random, pair.second, (sample / 2) % object.num_charts()),
                                        DrawUniform(random, -6.0, 6.0)};
      const ContactCoordinates normalized = NormalizeContact(fingertip, object, kappa);
      EXPECT_TRUE(MatrixNear(CalcTouchingPose(fingertip, object, normalized).matrix(),
                             CalcTouchingPose(fingertip, object, kappa).matrix(), kRounding));
      EXPECT_LE(std::abs(normalized.psi), kPi);
      changes += normalized.alpha_f.chart != kappa.alpha_f.chart ? 1 : 0;
      changes += normalized.alpha_o.chart != kappa.alpha_o.chart ? 1 : 0;
    }
  }
  EXPECT_GT(changes, 50);
}

// Pose error after one second of rolling a blunt fingertip over an ellipsoid, against a fine reference.
double CalcIntegrationError(int steps) {
  const Ellipsoid fingertip({0.008, 0.007, 0.010});
  const Ellipsoid object({0.05, 0.03, 0.02});
  // Given in the bodies' frames, so that the motion does not depend on the charts.
  const auto twist = [](double t, const ContactGeometry& contact) {
    const Vector3d slip_o(0.01 * std::sin(t), 0.005, 0.0);
    const Vector3d omega_f(2.0 * std::cos(t), 1.0, std::sin(3.0 * t));
    Vector6d V;
    V << contact.g_o_cf.linear().transpose() * slip_o, contact.g_f_cf.linear().transpose() * omega_f;
    V(2) = 0.0;
    return V;
  };
  const auto integrate = [&](int count) {
    ContactCoordinates kappa = {{0.3, 0.2, 0}, {0.8, 0.4, 0}, 0.5};
    const double dt = 1.0 / count;
    for (int i = 0; i < count; ++i) kappa = IntegrateKappa(fingertip, object, kappa, i * dt, dt, twist);
    return CalcTouchingPose(fingertip, object, kappa);
  };
  static const Pose reference = integrate(4096);
  return (integrate(steps).matrix() - reference.matrix()).norm();
}

TEST(IntegrateKappaTest, IsOfFourthOrder) {
  const double coarse = CalcIntegrationError(64);
  const double middle = CalcIntegrationError(128);
  const double fine = CalcIntegrationError(256);
  EXPECT_GT(fine, 1e-13) << "the errors compared must stand above rounding";
  EXPECT_NEAR(std::log2(coarse / middle), 4.0, 0.3);
  EXPECT_NEAR(std::log2(middle / fine), 4.0, 0.3);
}

}  // namespace
}  // namespace dexcheck::testing::contact_geometry_test
