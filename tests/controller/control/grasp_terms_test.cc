// Terms of a grasp whose contacts are bonds, or overlap: frames, G, J_B' and their rates against motions of
// points in the world, by differences.

#include "controller/control/grasp_terms.h"

#include <gtest/gtest.h>

#include <random>
#include <stdexcept>
#include <vector>

#include "controller/contact/contact_geometry.h"
#include "controller/object/so3.h"
#include "tests/common/finite_difference.h"
#include "tests/common/matrix_near.h"
#include "tests/common/reduction_map.h"
#include "tests/controller/control/grasp_scene.h"

namespace dexcheck::testing::grasp_terms_test {
namespace {

// Two formulas for one quantity of order one.
constexpr double kRounding = 1e-14;
// Five-point differences along motions of 1 m/s and 1 rad/s, which add up to about 10 rad/s at a fingertip:
// truncation h^4 10^5 / 30 = 3e-13, rounding eps / h = 2e-12; measured 4e-12.
constexpr double kStep = 1e-4, kDifference = 4e-11;
// Frames of contacts that roll and slip at 1 m/s turn at about 100 rad/s: truncation h^4 100^5 / 30 = 3e-8;
// measured 1e-8.
constexpr double kFastDifference = 1e-7;
// Least effect of a wrong formula.
constexpr double kVisible = 1e-3;

/// The torus in the right hand; robot, object and contacts move at random and slip.
class GraspTermsTest : public ::testing::Test {
 protected:
  GraspTermsTest() {
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    for (double& rate : scene_.xi) rate = uniform(random_);
    for (double& rate : scene_.X_o_dot) rate = uniform(random_);
    scene_.SetState();
    q_ = scene_.q;
    X_o_ = scene_.X_o;
    kappa_ = scene_.kappa;
    q_dot_ = CalcReductionMap(scene_.model, q_, scene_.xi).S * scene_.xi;
    StoreContactRates();
  }

  void StoreContactRates() {
    kappa_dot_.clear();
    for (const Contact& contact : scene_.grasp.contacts()) kappa_dot_.push_back(contact.kappa_dot);
  }

  /// Everything as it is a time t later, to first order.
  void Move(double t) {
    scene_.q = q_ + t * q_dot_;
    scene_.X_o = X_o_ + t * scene_.X_o_dot;
    for (size_t i = 0; i < kappa_.size(); ++i) scene_.kappa[i] = Displace(kappa_[i], t * kappa_dot_[i]);
    scene_.SetState();
  }

  /// The rate of what `term` gives along the motion.
  template <typename Term>
  MatrixXd CalcRate(const Term& term) {
    const MatrixXd rate = Differentiate(
        [&](double t) -> MatrixXd {
          Move(t);
          return term();
        },
        kStep);
    Move(0.0);
    return rate;
  }

  /// Velocity of a fingertip's point against the object's point, both material, in Sigma_cf.
  Vector3d CalcPointSlip(size_t finger, const Vector3d& p_f, const Pose& g_o_cf) {
    const Matrix3d R_B_cf = CalcObjectPose(X_o_).linear() * g_o_cf.linear();
    const int frame = scene_.fingertips[finger];
    const Vector3d p_dot = CalcRate([&] { return scene_.robot.CalcFramePose(frame) * p_f; }) -
                           CalcRate([&] { return CalcObjectPose(scene_.X_o) * g_o_cf.translation(); });
    return R_B_cf.transpose() * p_dot;
  }

  /// Bonds a few millimetres beside the contacts, so that no two points or frames are the same.
  [[nodiscard]] std::vector<Bond> MakeBonds() {
    std::normal_distribution<double> beside(0.0, 2e-3);
    std::vector<Bond> bonds;
    for (const Contact& contact : scene_.grasp.contacts()) {
      Bond bond{contact.geometry.g_f_cf.translation(), contact.geometry.g_o_cf};
      for (double& x : bond.p_f) x += beside(random_);
      for (double& x : bond.g_o_cf.translation()) x += beside(random_);
      bond.g_o_cf.rotate(Eigen::AngleAxisd(0.3, Vector3d(0.6, 0.0, 0.8)));
      bonds.push_back(bond);
    }
    return bonds;
  }

  void SetBonds(const std::vector<Bond>& bonds) {
    scene_.grasp.SetBonds(bonds);
    scene_.SetState();
    StoreContactRates();
  }

  void SetOverlaps(const std::vector<double>& overlaps) {
    scene_.grasp.SetOverlaps(overlaps);
    scene_.SetState();
    StoreContactRates();
  }

  std::mt19937 random_{91};
  GraspScene scene_;
  VectorXd q_, q_dot_;
  Vector6d X_o_;
  std::vector<ContactCoordinates> kappa_;
  std::vector<Vector5d> kappa_dot_;
};

using Bonds = GraspTermsTest;

TEST_F(Bonds, SlipIsThatOfTheTwoPoints) {
  const std::vector<Bond> bonds = MakeBonds();
  SetBonds(bonds);
  for (size_t i = 0; i < bonds.size(); ++i) {
    const Vector3d slip = CalcPointSlip(i, bonds[i].p_f, bonds[i].g_o_cf);
    ASSERT_GT(slip.norm(), 0.1);
    EXPECT_TRUE(
        MatrixNear(scene_.grasp.slip().segment<3>(3 * static_cast<Eigen::Index>(i)), slip, kDifference));
  }
}

// F_o = G f_c: a force at the object's point, in Sigma_o.
TEST_F(Bonds, ForcesActAtTheObjectsPoints) {
  const std::vector<Bond> bonds = MakeBonds();
  SetBonds(bonds);
  VectorXd f_c(scene_.num_forces());
  std::normal_distribution<double> normal;
  for (double& entry : f_c) entry = normal(random_);
  Vector6d F_o = Vector6d::Zero();
  for (size_t i = 0; i < bonds.size(); ++i) {
    const Vector3d f = bonds[i].g_o_cf.linear() * f_c.segment<3>(3 * static_cast<Eigen::Index>(i));
    F_o.head<3>() += f;
    F_o.tail<3>() += bonds[i].g_o_cf.translation().cross(f);
  }
  EXPECT_TRUE(MatrixNear(scene_.grasp.G() * f_c, F_o, kRounding));
}

TEST_F(Bonds, RatesAreThoseOfPointsThatDoNotRoll) {
  const MatrixXd rolling = scene_.grasp.J_B_dot();
  ASSERT_GT(scene_.grasp.G_dot().norm(), kVisible);
  SetBonds(MakeBonds());
  const MatrixXd J_B_dot = CalcRate([&] { return scene_.grasp.J_B(); });
  EXPECT_TRUE(MatrixNear(scene_.grasp.J_B_dot(), J_B_dot, kDifference));
  EXPECT_GT((rolling - J_B_dot).norm(), kVisible);
  EXPECT_TRUE(scene_.grasp.G_dot().isZero(0.0));
  for (const Contact& contact : scene_.grasp.contacts()) EXPECT_TRUE(contact.kappa_dot.isZero(0.0));
  EXPECT_TRUE(MatrixNear(scene_.grasp.slip_bias(), J_B_dot * scene_.xi, 10.0 * kDifference));
}

TEST_F(Bonds, HoldWhateverTheOverlapsAre) {
  SetBonds(MakeBonds());
  const MatrixXd J_B = scene_.grasp.J_B();
  const MatrixXd G = scene_.grasp.G();
  SetOverlaps({1e-4, 2e-4, 3e-4, 4e-4});
  EXPECT_EQ(scene_.grasp.J_B(), J_B);
  EXPECT_EQ(scene_.grasp.G(), G);
}

TEST_F(Bonds, PoseAndCoordinatesGiveTheSameTerms) {
  SetBonds(MakeBonds());
  GraspTerms by_pose = scene_.grasp;
  by_pose.SetPose(scene_.robot, scene_.grasp.X_Bo(), scene_.grasp.V_Bo(), scene_.kappa);
  EXPECT_TRUE(MatrixNear(by_pose.J_B(), scene_.grasp.J_B(), kRounding));
  EXPECT_TRUE(MatrixNear(by_pose.J_B_dot(), scene_.grasp.J_B_dot(), 10.0 * kRounding));
  EXPECT_TRUE(MatrixNear(by_pose.slip(), scene_.grasp.slip(), kRounding));
  EXPECT_THROW(static_cast<void>(by_pose.X_o()), std::logic_error);
  EXPECT_THROW(static_cast<void>(by_pose.X_o_dot()), std::logic_error);
  EXPECT_THROW(static_cast<void>(by_pose.coordinates()), std::logic_error);
}

using Overlaps = GraspTermsTest;

const std::vector<double> kOverlaps = {1e-3, 2e-3, 5e-4, 3e-3};  // m

TEST_F(Overlaps, ContactsStandMidway) {
  SetOverlaps(kOverlaps);
  for (size_t i = 0; i < kOverlaps.size(); ++i) {
    const ContactGeometry& geometry = scene_.grasp.contacts()[i].geometry;
    const double radius = *scene_.model.frame(scene_.fingertips[i]).sphere_radius;
    EXPECT_NEAR(geometry.g_f_cf.translation().norm(), radius - kOverlaps[i] / 2.0, kRounding);
    EXPECT_NEAR(scene_.surface.Project(geometry.g_o_cf.translation()).distance, -kOverlaps[i] / 2.0,
                kRounding);
  }
}

TEST_F(Overlaps, SlipIsThatOfThePointsMidway) {
  const VectorXd of_rigid_bodies = scene_.grasp.slip();
  SetOverlaps(kOverlaps);
  for (size_t i = 0; i < kOverlaps.size(); ++i) {
    const ContactGeometry geometry = scene_.grasp.contacts()[i].geometry;
    const Vector3d slip = CalcPointSlip(i, geometry.g_f_cf.translation(), geometry.g_o_cf);
    EXPECT_TRUE(
        MatrixNear(scene_.grasp.slip().segment<3>(3 * static_cast<Eigen::Index>(i)), slip, kDifference));
  }
  EXPECT_GT((scene_.grasp.slip() - of_rigid_bodies).norm(), kVisible);
}

TEST_F(Overlaps, RatesMatchDifferences) {
  const MatrixXd J_B_dot_rigid = scene_.grasp.J_B_dot();
  const MatrixXd G_dot_rigid = scene_.grasp.G_dot();
  SetOverlaps(kOverlaps);
  const MatrixXd J_B_dot = CalcRate([&] { return scene_.grasp.J_B(); });
  const MatrixXd G_dot = CalcRate([&] { return scene_.grasp.G(); });
  EXPECT_TRUE(MatrixNear(scene_.grasp.J_B_dot(), J_B_dot, kFastDifference));
  EXPECT_TRUE(MatrixNear(scene_.grasp.G_dot(), G_dot, kFastDifference));
  EXPECT_GT((J_B_dot - J_B_dot_rigid).norm(), kVisible);
  EXPECT_GT((G_dot - G_dot_rigid).norm(), kVisible);
}

}  // namespace
}  // namespace dexcheck::testing::grasp_terms_test
