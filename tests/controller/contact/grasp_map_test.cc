#include "controller/contact/grasp_map.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "controller/object/so3.h"
#include "tests/common/linear_algebra.h"
#include "tests/common/matrix_near.h"
#include "tests/controller/contact/test_finger.h"

namespace dexcheck::testing::grasp_map_test {
namespace {

// Rounding of a few dozen operations on numbers of order one.
constexpr double kRounding = 1e-14;
// Five-point differences of motions of order 1 rad/s; measured 5.7e-12.
constexpr double kDifference = 5e-11;

Contact MakeContact(const Surface& fingertip, const Surface& object, const ContactCoordinates& kappa) {
  Contact contact;
  contact.geometry = CalcContactGeometry(fingertip, object, kappa);
  return contact;
}

// Precision grasp of the torus: contacts on the outer equator at the angles given, degrees.
std::vector<Contact> MakeTorusGrasp(const std::vector<double>& angles) {
  const Sphere tip(0.009);
  const Torus torus(0.035, 0.011);
  std::vector<Contact> contacts;
  contacts.reserve(angles.size());
  for (const double angle : angles) {
    contacts.push_back(MakeContact(tip, torus, {{0.2, -0.3, 0}, {DegToRad(angle), 0.0, 0}, 0.7}));
  }
  return contacts;
}

MatrixXd CalcG(const std::vector<Contact>& contacts) {
  Matrix6Xd G(6, 3 * contacts.size());
  CalcGraspMap(contacts, G);
  return G;
}

TEST(AdjointTest, IsTheBodyTwistOfTheMovedFrame) {
  std::mt19937 random(51);
  const Pose g = CalcScrewMotion(DrawVector(random, 6), 1.0);
  const Vector6d V = DrawVector(random, 6);
  EXPECT_TRUE(MatrixNear(CalcAdjoint(g) * CalcAdjointInverse(g), Matrix6d::Identity(), kRounding));
  EXPECT_TRUE(
      MatrixNear(CalcWrenchTransform(g), Matrix6d(CalcInverse(CalcAdjoint(g)).transpose()), kRounding));
  // Seen in a frame moved by g, the motion exp(V t) is g exp(V t) g^-1, whose twist is Ad_g V.
  const auto moved = [&](double t) { return Pose(g * CalcScrewMotion(V, t) * g.inverse()); };
  EXPECT_TRUE(MatrixNear(DifferentiatePose(moved), CalcAdjoint(g) * V, kDifference));
  // d/dt Ad_g = Ad_g ad_V along g(t) = g exp(V t)
  const auto along = [&](double t) { return MatrixXd(CalcAdjoint(g * CalcScrewMotion(V, t))); };
  EXPECT_TRUE(MatrixNear(Differentiate(along), CalcAdjoint(g) * CalcTwistCross(V), kDifference));
}

// The wrench on the object from force and moment arm in the object frame, without any adjoint.
TEST(GraspMapTest, WrenchIsForceAndMomentArm) {
  std::mt19937 random(52);
  const Ellipsoid object({0.05, 0.03, 0.02});
  const Sphere tip(0.009);
  std::vector<Contact> contacts;
  Vector6d expected = Vector6d::Zero();
  VectorXd f_c(9);
  for (Eigen::Index i = 0; i < 3; ++i) {
    const ContactCoordinates kappa = {{DrawUniform(random, -3.0, 3.0), DrawUniform(random, -1.0, 1.0), 1},
                                      {DrawUniform(random, -3.0, 3.0), DrawUniform(random, -1.0, 1.0), 0},
                                      DrawUniform(random, -3.0, 3.0)};
    contacts.push_back(MakeContact(tip, object, kappa));
    const Vector3d f = DrawVector(random, 3);
    f_c.segment<3>(3 * i) = f;

    const SurfaceGeometry at = object.Evaluate(kappa.alpha_o);
    const Vector3d into_object = -at.R.col(2);
    const Vector3d x = Eigen::AngleAxisd(kappa.psi, into_object) * Vector3d(at.R.col(0));
    const Vector3d y = into_object.cross(x);
    const Vector3d force = f(0) * x + f(1) * y + f(2) * into_object;
    expected.head<3>() += force;
    expected.tail<3>() += at.p.cross(force);
  }
  ASSERT_GT(expected.norm(), 0.1);
  EXPECT_TRUE(MatrixNear(CalcG(contacts) * f_c, expected, kRounding));
}

TEST(GraspMapTest, OpposedNormalForcesAreInternal) {
  const std::vector<Contact> contacts = MakeTorusGrasp({0.0, 180.0});
  VectorXd internal_force = VectorXd::Zero(6);
  internal_force(2) = internal_force(5) = 5.0;
  // sin(pi) is 1.2e-16, not 0
  EXPECT_TRUE(MatrixNear(CalcG(contacts) * internal_force, Vector6d::Zero(), kRounding));
}

TEST(GraspMapTest, RateMatchesDifferencesForMovingContacts) {
  std::mt19937 random(53);
  const Ellipsoid tip({0.008, 0.007, 0.010});
  const Torus torus(0.035, 0.011);
  const std::array<ContactCoordinates, 3> kappa = {ContactCoordinates{{0.2, 0.3, 0}, {1.0, 0.4, 0}, 0.5},
                                                   ContactCoordinates{{-1.2, 0.5, 1}, {-2.0, 3.0, 0}, -2.5},
                                                   ContactCoordinates{{2.2, -0.3, 1}, {2.5, -0.4, 0}, 1.5}};
  std::array<Vector5d, 3> kappa_dot;
  for (Vector5d& rate : kappa_dot) rate = DrawVector(random, 5);
  const auto contacts_at = [&](double t) {
    std::vector<Contact> contacts;
    for (std::size_t i = 0; i < 3; ++i) {
      contacts.push_back(MakeContact(tip, torus, Displace(kappa[i], t * kappa_dot[i])));
      contacts.back().kappa_dot = kappa_dot[i];
    }
    return contacts;
  };
  Matrix6Xd G_dot(6, 9);
  CalcGraspMapDot(contacts_at(0.0), G_dot);
  ASSERT_GT(G_dot.norm(), 1.0);
  EXPECT_TRUE(MatrixNear(G_dot, Differentiate([&](double t) { return CalcG(contacts_at(t)); }), kDifference));
}

}  // namespace
}  // namespace dexcheck::testing::grasp_map_test
