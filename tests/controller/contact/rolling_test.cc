#include <gtest/gtest.h>

#include "controller/common/errors.h"
#include "controller/contact/contact_geometry.h"
#include "tests/common/matrix_near.h"
#include "tests/common/throws.h"
#include "tests/controller/contact/contact_fixtures.h"

namespace dexcheck::testing::rolling_test {
namespace {

constexpr int kSamples = 20;
// Rounding of a few dozen operations on rates of order one.
constexpr double kRounding = 1e-13;
// Five-point differences, error h^4 f^(5) / 30 with h = 1e-3, relative to the rates; measured 1.3e-9 where a
// ball contact passes near its chart's pole.
constexpr double kDifference = 1e-8;

ContactCoordinates DrawKappa(std::mt19937& random, const SurfacePair& pair) {
  const auto& [fingertip, object] = pair;
  const auto draw_chart = [&](const NamedSurface& named) {
    return DrawUniform(random, 0.0, 1.0) < 0.5 ? 0 : named.surface->num_charts() - 1;
  };
  return NormalizeContact(*fingertip.surface, *object.surface,
                          {DrawPoint(random, fingertip, draw_chart(fingertip)),
                           DrawPoint(random, object, draw_chart(object)), DrawUniform(random, -3.1, 3.1)});
}

TEST(BallOnPlaneTest, RollsByHand) {
  // A ball of radius 0.1 m stands on the plane and rolls along the plane's +x at 2 rad/s about +y. At psi = 0
  // the contact frame has x along +x, y along -y, z down: omega = (0, -2, 0) there.
  const Sphere ball(0.1);
  const Plane floor;
  const ContactCoordinates kappa = {{0.7, 0.0, 0}, {0.3, -0.2, 0}, 0.0};
  const ContactGeometry contact = CalcContactGeometry(ball, floor, kappa);
  EXPECT_TRUE(
      MatrixNear(contact.g_o_cf.linear(), Vector3d(1.0, -1.0, -1.0).asDiagonal().toDenseMatrix(), kRounding));
  EXPECT_TRUE(MatrixNear(contact.g_o_cf.translation(), Vector3d(0.3, -0.2, 0.0), kRounding));

  Vector6d V;
  V << 0.0, 0.0, 0.0, 0.0, -2.0, 0.0;
  Vector5d expected;
  // M_f alphadot_f = K_f^-1 [2; 0] = 0.2 m/s along the ball's x, M_f = 0.1 m; the floor point moves at 0.2
  // m/s.
  expected << 2.0, 0.0, 0.2, 0.0, 0.0;
  EXPECT_TRUE(MatrixNear(CalcKappaDot(contact, V), expected, kRounding));

  // Spinning in place turns psi only.
  V << 0.0, 0.0, 0.0, 0.0, 0.0, 3.0;
  expected << 0.0, 0.0, 0.0, 0.0, 3.0;
  EXPECT_TRUE(MatrixNear(CalcKappaDot(contact, V), expected, kRounding));

  // Sliding without turning moves the contact over the floor only: +y of the contact frame is -y of the
  // floor.
  V << 0.5, 0.25, 0.0, 0.0, 0.0, 0.0;
  expected << 0.0, 0.0, 0.5, -0.25, 0.0;
  EXPECT_TRUE(MatrixNear(CalcKappaDot(contact, V), expected, kRounding));
}

TEST(BallOnPlaneTest, PsiTurnsAboutTheFingertipsNormal) {
  const Sphere ball(0.1);
  const Plane floor;
  constexpr double kPsi = 0.4;
  const ContactGeometry contact = CalcContactGeometry(ball, floor, {{0.0, 0.0, 0}, {0.0, 0.0, 0}, kPsi});
  // The fingertip's normal points down, so a positive psi turns x_co clockwise seen from above.
  const Vector3d x_cf = contact.g_o_cf.linear().col(0);
  EXPECT_TRUE(MatrixNear(x_cf, Vector3d(std::cos(kPsi), -std::sin(kPsi), 0.0), kRounding));
  const Vector3d n_f = contact.g_o_cf.linear().col(2);
  EXPECT_TRUE(MatrixNear(x_cf, Eigen::AngleAxisd(kPsi, n_f) * Vector3d::UnitX(), kRounding));
}

/// A motion through prescribed contact coordinates, with rolling, slip and spin all present.
struct PrescribedMotion {
  Vector5d kappa_dot;
  ContactGeometry contact;
  Vector6d V;  ///< V_co_cf^cf, by differences of the pose.
};

PrescribedMotion DrawMotion(std::mt19937& random, const SurfacePair& pair) {
  const Surface& fingertip = *pair.first.surface;
  const Surface& object = *pair.second.surface;
  const ContactCoordinates kappa = DrawKappa(random, pair);
  PrescribedMotion motion{DrawVector(random, 5), CalcContactGeometry(fingertip, object, kappa), {}};
  if (pair.second.name == "plane") motion.kappa_dot.segment<2>(2) *= 0.01;
  if (pair.second.name == "cylinder") motion.kappa_dot(3) *= 0.01;
  const auto pose = [&](double t) {
    return CalcTouchingPose(fingertip, object, Displace(kappa, t * motion.kappa_dot));
  };
  motion.V = CalcRelativeTwist(motion.contact, DifferentiatePose(pose), Vector6d::Zero());
  return motion;
}

// (40) must give back the prescribed rates.
TEST(KappaDotTest, RecoversThePrescribedRatesOfEveryPair) {
  std::mt19937 random(21);
  double largest_slip = 0.0;
  for (const SurfacePair& pair : MakeAllPairs()) {
    SCOPED_TRACE(pair.first.name + " on " + pair.second.name);
    for (int sample = 0; sample < kSamples; ++sample) {
      const PrescribedMotion motion = DrawMotion(random, pair);
      EXPECT_TRUE(MatrixNear(CalcKappaDot(motion.contact, motion.V), motion.kappa_dot, kDifference));
      EXPECT_NEAR(motion.V(2), 0.0, kDifference) << "the motion must keep contact";
      largest_slip = std::max(largest_slip, motion.V.head<2>().norm());
    }
  }
  EXPECT_GT(largest_slip, 0.01);
}

// Faults in (40) that the comparison above must see. Each is a mutated copy of the formula.
using KappaDotFormula = Vector5d (*)(const ContactGeometry&, const Vector6d&);

Vector5d AssembleKappaDot(const ContactGeometry& c, const Vector2d& s_f, const Vector2d& s_o,
                          double psi_dot) {
  Vector5d kappa_dot;
  kappa_dot << c.fingertip.M.inverse() * s_f, c.object.M.inverse() * s_o, psi_dot;
  return kappa_dot;
}

Vector5d CalcWithoutSpin(const ContactGeometry& c, const Vector6d& V) {
  Vector5d kappa_dot = CalcKappaDot(c, V);
  kappa_dot(4) -= V(5);
  return kappa_dot;
}

Vector5d CalcWithoutSlip(const ContactGeometry& c, const Vector6d& V) {
  Vector6d turning = V;
  turning.head<3>().setZero();
  return CalcKappaDot(c, turning);
}

// Print's subscripts: psidot = T_o M_c alphadot_c + T_o M_c alphadot_c, read with the object's side twice.
Vector5d CalcWithPrintedTorsion(const ContactGeometry& c, const Vector6d& V) {
  Vector5d kappa_dot = CalcKappaDot(c, V);
  kappa_dot(4) = 2.0 * c.object.T.dot(c.object.M * kappa_dot.segment<2>(2));
  return kappa_dot;
}

Vector5d CalcWithInwardNormals(const ContactGeometry& c, const Vector6d& V) {
  ContactGeometry inward = c;
  inward.object.K *= -1.0;
  const Matrix2d K = inward.fingertip.K + c.R_psi * inward.object.K * c.R_psi;
  const Vector2d s_f = K.inverse() * Vector2d(-V(4), V(3));
  return AssembleKappaDot(c, s_f, c.R_psi * s_f,
                          V(5) + c.fingertip.T.dot(s_f) + c.object.T.dot(c.R_psi * s_f));
}

Vector5d CalcWithProperRotation(const ContactGeometry& c, const Vector6d& V) {
  ContactGeometry mutated = c;
  mutated.R_psi.col(1) *= -1.0;
  const Matrix2d K = c.fingertip.K + mutated.R_psi * c.object.K * mutated.R_psi.transpose();
  const Vector2d s_f = K.inverse() * Vector2d(-V(4), V(3));
  const Vector2d s_o = mutated.R_psi * s_f;
  return AssembleKappaDot(c, s_f, s_o, V(5) + c.fingertip.T.dot(s_f) + c.object.T.dot(s_o));
}

double CalcLargestError(KappaDotFormula formula, const SurfacePair& pair) {
  std::mt19937 random(22);
  double largest = 0.0;
  for (int sample = 0; sample < kSamples; ++sample) {
    const PrescribedMotion motion = DrawMotion(random, pair);
    largest = std::max(largest, (formula(motion.contact, motion.V) - motion.kappa_dot).norm());
  }
  return largest;
}

TEST(KappaDotTest, FaultyFormulasFailTheComparison) {
  // A fault counts as seen when it exceeds the comparison's tolerance a million times.
  constexpr double kSeen = 1e6 * kDifference;
  for (const SurfacePair& pair : MakeAllPairs()) {
    if (pair.second.name != "torus" && pair.second.name != "ellipsoid") continue;
    SCOPED_TRACE(pair.first.name + " on " + pair.second.name);
    EXPECT_LT(CalcLargestError(&CalcKappaDot, pair), 10.0 * kDifference);
    for (const KappaDotFormula faulty : {&CalcWithoutSpin, &CalcWithoutSlip, &CalcWithPrintedTorsion,
                                         &CalcWithInwardNormals, &CalcWithProperRotation})
      EXPECT_GT(CalcLargestError(faulty, pair), kSeen);
  }
}

TEST(KappaDotTest, ContactsThatAreNotPointsAreAnError) {
  const Vector6d V = Vector6d::Ones();
  const ContactGeometry flat = CalcContactGeometry(Plane(), Plane(), {});
  EXPECT_TRUE(Throws<SingularityError>([&] { return CalcKappaDot(flat, V); }, "isolated point"));
  const ContactGeometry line = CalcContactGeometry(Cylinder(0.01), Plane(), {});
  EXPECT_TRUE(Throws<SingularityError>([&] { return CalcKappaDot(line, V); }, "isolated point"));
  // A ball of 25 mm does not fit into a hole of 24 mm.
  const Torus torus(0.035, 0.011);
  const ContactGeometry hole = CalcContactGeometry(Sphere(0.025), torus, {{}, {0.0, kPi, 0}, 0.0});
  EXPECT_TRUE(Throws<SingularityError>([&] { return CalcKappaDot(hole, V); }, "isolated point"));
  EXPECT_GT(CalcKappaDot(CalcContactGeometry(Sphere(0.023), torus, {{}, {0.0, kPi, 0}, 0.0}), V).norm(), 1.0);
  ContactCoordinates bad;
  bad.psi = std::nan("");
  EXPECT_TRUE(Throws<std::invalid_argument>([&] { return CalcContactGeometry(torus, torus, bad); }, "psi"));
}

}  // namespace
}  // namespace dexcheck::testing::rolling_test
