#include <gtest/gtest.h>

#include <vector>

#include "controller/contact/grasp_map.h"
#include "controller/object/so3.h"
#include "tests/common/linear_algebra.h"
#include "tests/common/matrix_near.h"
#include "tests/controller/contact/test_finger.h"

namespace dexcheck::testing::contact_jacobian_test {
namespace {

// Rounding of a few dozen operations on numbers of order one.
constexpr double kRounding = 1e-14;
// Five-point differences of motions of order 1 rad/s; measured 1.6e-11.
constexpr double kDifference = 1e-10;

// A fingertip and an object that roll on each other; every test visits sphere and ellipsoid on torus.
class ContactJacobianTest : public ::testing::Test {
 protected:
  [[nodiscard]] std::vector<RollingFinger> MakeMotions() {
    std::vector<RollingFinger> motions;
    for (const double v : {0.3, 2.0, 3.0}) {
      motions.emplace_back(tip_, torus_, random_, ContactCoordinates{{0.4, 0.5, 0}, {0.8, v, 0}, 0.6});
      motions.emplace_back(blunt_tip_, torus_, random_,
                           ContactCoordinates{{-0.7, 0.5, 1}, {2.8, v, 0}, -1.6});
    }
    return motions;
  }

  static MatrixXd CalcRows(const RollingFinger& motion, double t) {
    MatrixXd rows(3, 4);
    CalcContactJacobian(motion.CalcContact(t), motion.CalcBodyJacobian(t), rows);
    return rows;
  }

  std::mt19937 random_{61};
  Sphere tip_{0.009};
  Ellipsoid blunt_tip_{{0.008, 0.007, 0.010}};
  Torus torus_{0.035, 0.011};
};

// f_c . (J_h qdot) is the power of the contact force at the fingertip's material point, and f_c . (G^T V_o)
// that at the object's; both from velocities of points in the world, by differences.
TEST_F(ContactJacobianTest, DualToVirtualWork) {
  for (const RollingFinger& motion : MakeMotions()) {
    const Contact contact = motion.CalcContact(0.0);
    const Vector3d f_c = DrawVector(random_, 3);
    const Matrix3d R_Bc = motion.CalcFingertipPose(0.0).linear() * contact.geometry.g_f_cf.linear();
    const Vector3d force = R_Bc * f_c;
    const auto calc_power = [&](const auto& pose, const Vector3d& point) {
      const Vector3d velocity = Differentiate([&](double t) { return MatrixXd(pose(t) * point); });
      return force.dot(velocity);
    };
    const double on_finger = calc_power([&](double t) { return motion.CalcFingertipPose(t); },
                                        contact.geometry.g_f_cf.translation());
    const double on_object =
        calc_power([&](double t) { return motion.CalcObjectPose(t); }, contact.geometry.g_o_cf.translation());
    ASSERT_GT(std::abs(on_finger), 1e-3);
    EXPECT_NEAR(f_c.dot(CalcRows(motion, 0.0) * motion.q_dot()), on_finger, kDifference);
    Matrix6Xd G(6, 3);
    CalcGraspMap({&contact, 1}, G);
    EXPECT_NEAR(f_c.dot(G.transpose() * motion.V_o()), on_object, kDifference);
  }
}

// Rolling satisfies the grasp constraint (33) by (29); a transposed or inverted adjoint does not.
TEST_F(ContactJacobianTest, RollingSatisfiesTheGraspConstraint) {
  for (const RollingFinger& motion : MakeMotions()) {
    const Contact contact = motion.CalcContact(0.0);
    Matrix6Xd G(6, 3);
    CalcGraspMap({&contact, 1}, G);
    const Vector3d object_side = G.transpose() * motion.V_o();
    ASSERT_GT(object_side.norm(), 1e-3);
    EXPECT_TRUE(MatrixNear(CalcRows(motion, 0.0) * motion.q_dot(), object_side, kRounding));

    const Vector6d V_f = motion.CalcBodyJacobian(0.0) * motion.q_dot();
    const Matrix6d Ad = CalcAdjointInverse(contact.geometry.g_f_cf);
    for (const Matrix6d& wrong : {Matrix6d(Ad.transpose()), Matrix6d(CalcInverse(Ad))}) {
      EXPECT_GT(((wrong * V_f).head<3>() - object_side).norm(), 1e-3);
    }
  }
}

TEST_F(ContactJacobianTest, RateMatchesDifferencesWhileTheFingerRolls) {
  double without_rolling = 0.0;
  for (const RollingFinger& motion : MakeMotions()) {
    Contact contact = motion.CalcContact(0.0);
    const Matrix6Xd J_f = motion.CalcBodyJacobian(0.0);
    const Matrix6Xd J_f_dot = Differentiate([&](double t) { return MatrixXd(motion.CalcBodyJacobian(t)); });
    MatrixXd rows_dot(3, 4);
    CalcContactJacobianDot(contact, J_f, J_f_dot, rows_dot);
    const MatrixXd expected = Differentiate([&](double t) { return CalcRows(motion, t); });
    ASSERT_GT(expected.norm(), 1e-2);
    EXPECT_TRUE(MatrixNear(rows_dot, expected, kDifference));
    // A contact point taken as fixed on the fingertip.
    contact.kappa_dot.setZero();
    CalcContactJacobianDot(contact, J_f, J_f_dot, rows_dot);
    without_rolling = std::max(without_rolling, (rows_dot - expected).norm());
  }
  EXPECT_GT(without_rolling, 1e6 * kDifference);
}

}  // namespace
}  // namespace dexcheck::testing::contact_jacobian_test
