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

// kappa_a - kappa_b with angles compared modulo 2 pi.
Vector5d CalcChange(const ContactCoordinates& a, const ContactCoordinates& b) {
  Vector5d change = a.CalcVector() - b.CalcVector();
  for (double& entry : change) entry = std::remainder(entry, 2.0 * kPi);
  return change;
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

// The bodies are led through prescribed contact coordinates, with rolling, slip and spin all present; their
// twist comes from differences of the pose, and (40) must give back the prescribed rates.
TEST(KappaDotTest, RecoversThePrescribedRatesOfEveryPair) {
  std::mt19937 random(21);
  double largest_slip = 0.0;
  for (const SurfacePair& pair : MakeAllPairs()) {
    const Surface& fingertip = *pair.first.surface;
    const Surface& object = *pair.second.surface;
    SCOPED_TRACE(pair.first.name + " on " + pair.second.name);
    for (int sample = 0; sample < kSamples; ++sample) {
      const ContactCoordinates kappa = DrawKappa(random, pair);
      Vector5d kappa_dot = DrawVector(random, 5);
      if (pair.second.name == "plane") kappa_dot.segment<2>(2) *= 0.01;
      if (pair.second.name == "cylinder") kappa_dot(3) *= 0.01;
      const auto g_of = [&](double t) {
        return CalcTouchingPose(fingertip, object, Displace(kappa, t * kappa_dot));
      };
      const ContactGeometry contact = CalcContactGeometry(fingertip, object, kappa);
      const Vector6d V = CalcRelativeTwist(contact, DifferentiatePose(g_of), Vector6d::Zero());
      EXPECT_TRUE(MatrixNear(CalcKappaDot(contact, V), kappa_dot, kDifference));
      EXPECT_NEAR(V(2), 0.0, kDifference) << "the motion must keep contact";
      largest_slip = std::max(largest_slip, V.head<2>().norm());
    }
  }
  EXPECT_GT(largest_slip, 0.01);
}

// How a sphere moves over an object.
enum class Motion { kRolling, kRollingWithSpin, kSlidingAndTurning };

// A sphere and an object that keep contact while the contact point travels over the object. No contact
// equation is used: the sphere's centre stays on the offset surface, its rotation is prescribed.
struct SphereMotion {
  const Sphere& ball;
  const Surface& object;
  SurfacePoint start;
  Vector2d alpha_o_dot;
  Matrix3d R_start;
  Vector3d omega;  // of the ball relative to the object, in the object frame, rad/s
  Vector6d V_o;    // body twist of the object relative to the ground

  [[nodiscard]] Vector3d CalcCentre(double t) const {
    const SurfaceGeometry at =
        object.Evaluate({start.u + t * alpha_o_dot.x(), start.v + t * alpha_o_dot.y(), start.chart});
    return at.p + ball.radius() * at.R.col(2);
  }
  [[nodiscard]] Pose CalcObjectPose(double t) const { return CalcScrewMotion(V_o, t); }
  [[nodiscard]] Pose CalcRelativePose(double t) const {
    Pose X_OF = Pose::Identity();
    Vector6d turn;
    turn << Vector3d::Zero(), omega;
    X_OF.linear() = CalcScrewMotion(turn, t).linear() * R_start;
    X_OF.translation() = CalcCentre(t);
    return X_OF;
  }
  // Contact coordinates by closest points: the object's to the centre, and the ball's in that direction.
  [[nodiscard]] ContactCoordinates CalcKappa(double t) const {
    const Pose X_OF = CalcRelativePose(t);
    ContactCoordinates kappa;
    kappa.alpha_o = object.ToChart(object.Project(X_OF.translation()).alpha, start.chart);
    const SurfaceGeometry o = object.Evaluate(kappa.alpha_o);
    kappa.alpha_f = ball.ToChart(ball.Project(X_OF.inverse() * o.p).alpha, chart_f);
    const Vector3d x_cf = X_OF.linear() * ball.Evaluate(kappa.alpha_f).R.col(0);
    kappa.psi = std::atan2(-o.R.col(1).dot(x_cf), o.R.col(0).dot(x_cf));
    return kappa;
  }
  int chart_f = 0;
};

SphereMotion DrawSphereMotion(std::mt19937& random, const Sphere& ball, const NamedSurface& object,
                              const SurfacePoint& start, Motion kind) {
  SphereMotion motion{.ball = ball,
                      .object = *object.surface,
                      .start = start,
                      .alpha_o_dot = DrawVector(random, 2),
                      .R_start = CalcScrewMotion(DrawVector(random, 6), 1.0).linear(),
                      .omega = Vector3d::Zero(),
                      .V_o = DrawVector(random, 6)};
  if (object.name == "plane") motion.alpha_o_dot *= object.length;
  if (object.name == "cylinder") motion.alpha_o_dot.y() *= object.length;
  const Vector3d n = object.surface->Evaluate(start).R.col(2);
  const Vector3d centre_velocity = Differentiate([&](double t) { return MatrixXd(motion.CalcCentre(t)); });
  // The ball's material point at the contact is at rest when v_centre - rho omega x n = 0.
  const Vector3d rolling = n.cross(centre_velocity) / ball.radius();
  if (kind == Motion::kRolling) motion.omega = rolling;
  if (kind == Motion::kRollingWithSpin) motion.omega = rolling + 2.0 * n;
  if (kind == Motion::kSlidingAndTurning) motion.omega = 3.0 * Vector3d(DrawVector(random, 3));
  motion.chart_f = motion.ball.Normalize(motion.CalcKappa(0.0).alpha_f).chart;
  return motion;
}

// The twist V_co_cf^cf of a motion, through (30) with both bodies moving relative to the ground.
Vector6d CalcMotionTwist(const SphereMotion& motion, const ContactGeometry& contact) {
  const Vector6d V_f = DifferentiatePose(
      [&](double t) { return Pose(motion.CalcObjectPose(t) * motion.CalcRelativePose(t)); });
  const Vector6d V_o = DifferentiatePose([&](double t) { return motion.CalcObjectPose(t); });
  return CalcRelativeTwist(contact, V_f, V_o);
}

Vector5d DifferentiateKappa(const SphereMotion& motion) {
  const ContactCoordinates kappa = motion.CalcKappa(0.0);
  return Differentiate([&](double t) { return MatrixXd(CalcChange(motion.CalcKappa(t), kappa)); });
}

struct SphereCase {
  std::string name;
  NamedSurface object;
  double v_low;
  double v_high;
};

std::vector<SphereCase> MakeSphereCases() {
  return {{"plane", MakePlane(), -0.03, 0.03},
          {"sphere", MakeSphere(), -1.0, 1.0},
          {"cylinder", MakeCylinder(), -0.04, 0.04},
          {"torus outer side", MakeTorus(), -0.5, 0.5},
          {"torus inner side", MakeTorus(), kPi - 0.5, kPi + 0.5},
          {"ellipsoid", MakeEllipsoid(), -1.0, 1.0}};
}

// Visits random motions of one kind of a sphere over every object.
template <typename Visitor>
void ForEachSphereMotion(Motion kind, const Visitor& visit) {
  std::mt19937 random(22);
  const Sphere ball(0.009);
  for (const SphereCase& c : MakeSphereCases()) {
    SCOPED_TRACE(c.name);
    for (int sample = 0; sample < kSamples; ++sample) {
      const int chart = sample % c.object.surface->num_charts();
      const SurfacePoint start = {DrawUniform(random, -1.0, 1.0), DrawUniform(random, c.v_low, c.v_high),
                                  chart};
      visit(c, DrawSphereMotion(random, ball, c.object, start, kind));
    }
  }
}

class SphereOnObjectTest : public ::testing::TestWithParam<Motion> {};

TEST_P(SphereOnObjectTest, KappaDotMatchesClosestPoints) {
  ForEachSphereMotion(GetParam(), [](const SphereCase&, const SphereMotion& motion) {
    const ContactGeometry contact = CalcContactGeometry(motion.ball, motion.object, motion.CalcKappa(0.0));
    const Vector6d V = CalcMotionTwist(motion, contact);
    const Vector5d expected = DifferentiateKappa(motion);
    ASSERT_GT(expected.norm(), 0.1);
    EXPECT_TRUE(
        MatrixNear(CalcKappaDot(contact, V) / expected.norm(), expected / expected.norm(), kDifference));
    if (GetParam() != Motion::kSlidingAndTurning) {
      EXPECT_TRUE(MatrixNear(V.head<3>(), Vector3d::Zero(), kDifference)) << "rolling must not slip";
    }
  });
}

INSTANTIATE_TEST_SUITE_P(Motions, SphereOnObjectTest,
                         ::testing::Values(Motion::kRolling, Motion::kRollingWithSpin,
                                           Motion::kSlidingAndTurning));

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

double CalcLargestError(Motion kind, KappaDotFormula formula, const std::string& object) {
  double largest = 0.0;
  ForEachSphereMotion(kind, [&](const SphereCase& c, const SphereMotion& motion) {
    if (c.name != object) return;
    const ContactGeometry contact = CalcContactGeometry(motion.ball, motion.object, motion.CalcKappa(0.0));
    const Vector5d expected = DifferentiateKappa(motion);
    const Vector5d error = formula(contact, CalcMotionTwist(motion, contact)) - expected;
    largest = std::max(largest, error.norm() / expected.norm());
  });
  return largest;
}

TEST(KappaDotTest, FaultyFormulasFailTheComparison) {
  // A fault counts as seen when it exceeds the comparison's tolerance a million times.
  constexpr double kSeen = 1e6 * kDifference;
  for (const std::string object : {"torus outer side", "torus inner side", "ellipsoid"}) {
    SCOPED_TRACE(object);
    EXPECT_LT(CalcLargestError(Motion::kRollingWithSpin, &CalcKappaDot, object), 10.0 * kDifference);
    EXPECT_GT(CalcLargestError(Motion::kRollingWithSpin, &CalcWithoutSpin, object), kSeen);
    EXPECT_GT(CalcLargestError(Motion::kSlidingAndTurning, &CalcWithoutSlip, object), kSeen);
    EXPECT_GT(CalcLargestError(Motion::kRolling, &CalcWithPrintedTorsion, object), kSeen);
    EXPECT_GT(CalcLargestError(Motion::kRolling, &CalcWithInwardNormals, object), kSeen);
    EXPECT_GT(CalcLargestError(Motion::kRolling, &CalcWithProperRotation, object), kSeen);
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
