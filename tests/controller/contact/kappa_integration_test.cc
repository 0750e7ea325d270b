// Integration of the contact coordinates over finite times, through chart changes.

#include <gtest/gtest.h>

#include "controller/contact/contact_geometry.h"
#include "tests/common/matrix_near.h"
#include "tests/controller/contact/contact_fixtures.h"

namespace dexcheck::testing::kappa_integration_test {
namespace {

// Rounding of a few dozen operations on numbers of order one.
constexpr double kRounding = 1e-13;

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

// A ball rolls on the plane along its own circle of latitude v: on the plane the contact then runs on a
// circle of equal geodesic curvature tan(v) / rho, and one turn of the ball changes psi by 2 pi sin(v).
TEST(IntegrateKappaTest, BallRollingOnItsLatitudeCircleByHand) {
  constexpr double kRadius = 0.02;
  constexpr double kLatitude = 0.5;
  constexpr int kSteps = 1000;
  const Sphere ball(kRadius);
  const Plane plane;
  const auto twist = [](double, const ContactGeometry&) {
    // M_f alphadot_f = rho [-omega_y; omega_x] with u_dot = 2 pi rad/s, v_dot = 0
    Vector6d V;
    V << 0.0, 0.0, 0.0, 0.0, -2.0 * kPi * std::cos(kLatitude), 0.0;
    return V;
  };
  ContactCoordinates kappa = {{0.0, kLatitude, 0}, {0.0, 0.0, 0}, 0.0};
  for (int i = 0; i < kSteps; ++i) kappa = IntegrateKappa(ball, plane, kappa, 0.0, 1.0 / kSteps, twist);

  const double turn = 2.0 * kPi * std::sin(kLatitude);
  const double plane_radius = kRadius / std::tan(kLatitude);
  // Rounding of 1000 steps; the integration error (2 pi dt)^4 is of that size too.
  constexpr double kTolerance = 1e-11;
  EXPECT_NEAR(std::remainder(kappa.psi - turn, 2.0 * kPi), 0.0, kTolerance);
  EXPECT_NEAR(std::remainder(kappa.alpha_f.u, 2.0 * kPi), 0.0, kTolerance);
  EXPECT_NEAR(kappa.alpha_f.v, kLatitude, kTolerance);
  // The path starts along +x and bends towards -y, because psi turns clockwise on the plane.
  EXPECT_NEAR(kappa.alpha_o.u, plane_radius * std::sin(turn), kTolerance);
  EXPECT_NEAR(kappa.alpha_o.v, -plane_radius * (1.0 - std::cos(turn)), kTolerance);
}

// A ball rolls once around a fixed sphere on a great circle through all four poles of the charts. The exact
// pose is known: at angle theta the centre is (rho_o + rho_f) n(theta), the ball has turned by (1 + rho_o /
// rho_f) theta.
class GreatCircleTest : public ::testing::Test {
 protected:
  static constexpr double kBallRadius = 0.009;
  static constexpr double kSphereRadius = 0.02;
  static constexpr double kTurnRatio = 1.0 + kSphereRadius / kBallRadius;

  [[nodiscard]] Pose CalcExactPose(double theta) const {
    Pose X_OF = Pose::Identity();
    const Vector3d n(std::cos(theta), 0.0, std::sin(theta));
    X_OF.translation() = (kSphereRadius + kBallRadius) * n;
    X_OF.linear() = Eigen::AngleAxisd(kTurnRatio * theta, axis_).toRotationMatrix() * R_start_;
    return X_OF;
  }

  // Body twist of the ball relative to the sphere for theta_dot = 1 rad/s.
  [[nodiscard]] Vector6d CalcExactTwist(double theta) const {
    const Vector3d tangent(-std::sin(theta), 0.0, std::cos(theta));
    const Matrix3d R_FO = CalcExactPose(theta).linear().transpose();
    Vector6d V;
    V << R_FO * (kSphereRadius + kBallRadius) * tangent, R_FO * kTurnRatio * axis_;
    return V;
  }

  [[nodiscard]] ContactCoordinates Integrate(double theta_end, int steps) {
    const auto twist = [&](double theta, const ContactGeometry& contact) {
      return CalcRelativeTwist(contact, CalcExactTwist(theta), Vector6d::Zero());
    };
    ContactCoordinates kappa = FindContact(ball_, sphere_, CalcExactPose(0.0)).kappa;
    const double d_theta = theta_end / steps;
    for (int i = 0; i < steps; ++i) {
      const ContactCoordinates next = IntegrateKappa(ball_, sphere_, kappa, i * d_theta, d_theta, twist);
      chart_changes_f_ += next.alpha_f.chart != kappa.alpha_f.chart ? 1 : 0;
      chart_changes_o_ += next.alpha_o.chart != kappa.alpha_o.chart ? 1 : 0;
      kappa = next;
    }
    return kappa;
  }

  Sphere ball_{kBallRadius};
  Sphere sphere_{kSphereRadius};
  Vector3d axis_{0.0, -1.0, 0.0};  // n x tangent
  Matrix3d R_start_ = Eigen::AngleAxisd(0.4, Vector3d(1.0, 2.0, 3.0).normalized()).toRotationMatrix();
  int chart_changes_f_ = 0;
  int chart_changes_o_ = 0;
};

TEST_F(GreatCircleTest, RollsThroughThePoles) {
  const ContactCoordinates kappa = Integrate(2.0 * kPi, 5000);
  EXPECT_GE(chart_changes_o_, 4);
  EXPECT_GE(chart_changes_f_, 2);
  // Fourth-order integration; measured 6.1e-12.
  constexpr double kTolerance = 6e-11;
  EXPECT_TRUE(MatrixNear(CalcTouchingPose(ball_, sphere_, kappa).matrix(), CalcExactPose(2.0 * kPi).matrix(),
                         kTolerance));
}

TEST_F(GreatCircleTest, FindContactRemovesTheDrift) {
  constexpr double kEnd = 2.0;
  const ContactCoordinates drifted = Integrate(kEnd, 20);
  const Pose exact = CalcExactPose(kEnd);
  ASSERT_GT((CalcTouchingPose(ball_, sphere_, drifted).matrix() - exact.matrix()).norm(), 1e-5);
  const FoundContact found = FindContact(ball_, sphere_, exact, drifted);
  EXPECT_TRUE(MatrixNear(CalcTouchingPose(ball_, sphere_, found.kappa).matrix(), exact.matrix(), kRounding));
  EXPECT_NEAR(found.gap, 0.0, kRounding);
}

}  // namespace
}  // namespace dexcheck::testing::kappa_integration_test
