// Loops R1 and L4 by hand: (4) written out for every row of Tables 1 and 3, multiplied as (5) says.

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "controller/dynamics/model_terms.h"
#include "tests/common/matrix_near.h"
#include "tests/common/paper_robot.h"
#include "tests/common/random_robot.h"

namespace dexcheck::testing::fingertip_pose_test {
namespace {

using Eigen::Matrix4d;

// Thirteen products of matrices with entries up to 2 m (17 where the platform stands off the origin).
// Measured 9e-16.
constexpr double kRounding = 8e-15;
// A wrong entry of a table must miss by far more.
constexpr double kVisible = 1e-3;

// The robot's own lengths, m; the paper gives those of the fingers only (Table 2).
constexpr double kWheelRadius = 0.1;
constexpr double kL1 = 0.30;
constexpr double kL2 = 0.35;
constexpr double kL3 = 0.38;
constexpr double kL3p = 0.10;
constexpr double kL4 = 0.12;
constexpr double kL5 = 0.14;
constexpr double kL6 = 0.16;
constexpr double kL7 = 0.25;
constexpr double kL8 = 0.06;
constexpr double kHf1 = 0.02100;
constexpr double kHf2 = 0.02853;
constexpr double kHf3 = 0.02716;
constexpr double kHf4 = 0.01850;

Matrix4d Translate(double x, double y, double z) {
  Matrix4d T;
  T << 1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1;
  return T;
}

// In each row theta = q + the table's q: sin(q - 90) = -cos q, cos(q - 90) = sin q, and so on. With alpha =
// -90, (4) is [c, -s, 0, a; 0, 0, 1, d; -s, -c, 0, 0]; with alpha = 90, [c, -s, 0, a; 0, 0, -1, -d; s, c, 0,
// 0].
// clang-format off
Matrix4d B_T_0(double x_c, double y_c, double phi) {
  const double c = std::cos(phi), s = std::sin(phi);
  return Matrix4d{{c, -s, 0, x_c}, {s, c, 0, y_c}, {0, 0, 1, kWheelRadius}, {0, 0, 0, 1}};
}

// Table 1, rows 0-1 and 1-2.
Matrix4d CalcWaist(double q_1, double q_2) {
  const double c1 = std::cos(q_1), s1 = std::sin(q_1), c2 = std::cos(q_2), s2 = std::sin(q_2);
  const Matrix4d T_1{{c1, -s1, 0, 0}, {s1, c1, 0, 0}, {0, 0, 1, kL1 + kL2}, {0, 0, 0, 1}};
  const Matrix4d T_2{{s2, c2, 0, 0}, {0, 0, 1, 0}, {c2, -s2, 0, 0}, {0, 0, 0, 1}};
  return T_1 * T_2;
}

// Table 1, rows 2-3 (side = -1, right) or 2-3' (side = 1, left), to 8-9.
Matrix4d CalcArm(double side, const Eigen::Matrix<double, 7, 1>& q) {
  const Eigen::Matrix<double, 7, 1> c = q.array().cos(), s = q.array().sin();
  const Matrix4d T_3{{c[0], -s[0], 0, kL3}, {s[0], c[0], 0, 0}, {0, 0, 1, side * (kL3p + kL4)}, {0, 0, 0, 1}};
  const Matrix4d T_4{{-s[1], -c[1], 0, 0}, {0, 0, 1, 0}, {-c[1], s[1], 0, 0}, {0, 0, 0, 1}};
  const Matrix4d T_5{{s[2], c[2], 0, 0}, {0, 0, 1, kL5 + kL6}, {c[2], -s[2], 0, 0}, {0, 0, 0, 1}};
  const Matrix4d T_6{{s[3], c[3], 0, 0}, {0, 0, 1, 0}, {c[3], -s[3], 0, 0}, {0, 0, 0, 1}};
  const Matrix4d T_7{{-c[4], s[4], 0, kL7}, {0, 0, 1, 0}, {s[4], c[4], 0, 0}, {0, 0, 0, 1}};
  const Matrix4d T_8{{-s[5], -c[5], 0, -kL8}, {0, 0, 1, 0}, {-c[5], s[5], 0, 0}, {0, 0, 0, 1}};
  const Matrix4d T_9{{s[6], c[6], 0, 0}, {0, 0, 1, 0}, {c[6], -s[6], 0, 0}, {0, 0, 0, 1}};
  return T_3 * T_4 * T_5 * T_6 * T_7 * T_8 * T_9;
}

// Table 3, and the fingertip at the end of the last phalanx.
Matrix4d CalcFinger(const Eigen::Vector4d& q) {
  const Eigen::Vector4d c = q.array().cos(), s = q.array().sin();
  const Matrix4d T_1{{-s[0], -c[0], 0, 0}, {0, 0, -1, 0}, {c[0], -s[0], 0, 0}, {0, 0, 0, 1}};
  const Matrix4d T_2{{c[1], -s[1], 0, kHf1}, {0, 0, -1, 0}, {s[1], c[1], 0, 0}, {0, 0, 0, 1}};
  const Matrix4d T_3{{c[2], -s[2], 0, kHf2}, {s[2], c[2], 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
  const Matrix4d T_4{{c[3], -s[3], 0, kHf3}, {s[3], c[3], 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
  return T_1 * T_2 * T_3 * T_4 * Translate(kHf4, 0, 0);
}
// clang-format on

// (5): B_T_rf = B_T_0 0_T_r r_T_rp rp_T_rf. q' = [q_v (3); waist (2), right arm (7), left arm (7); eight
// fingers of 4].
Matrix4d CalcR1(const VectorXd& q) {
  const Matrix4d palm_to_finger = Translate(-0.028, 0.050, 0.050);
  return B_T_0(q[0], q[1], q[2]) * CalcWaist(q[3], q[4]) * CalcArm(-1.0, q.segment<7>(5)) * palm_to_finger *
         CalcFinger(q.segment<4>(19));
}

Matrix4d CalcL4(const VectorXd& q) {
  // The thumb stands turned half about z.
  const Matrix4d half_turn = Eigen::Vector4d(-1.0, -1.0, 1.0, 1.0).asDiagonal();
  return B_T_0(q[0], q[1], q[2]) * CalcWaist(q[3], q[4]) * CalcArm(1.0, q.segment<7>(12)) *
         Translate(0.0, -0.050, 0.050) * half_turn * CalcFinger(q.segment<4>(47));
}

class FingertipPose : public ::testing::Test {
 protected:
  Matrix4d CalcPose(const char* frame, const VectorXd& q) {
    terms_.SetState(q, VectorXd::Zero(terms_.size()));
    return terms_.CalcFramePose(model_.FindFrame(frame)).matrix();
  }
  const RobotModel model_ = ReadPaperRobot();
  ModelTerms terms_{model_};
};

TEST_F(FingertipPose, IsTheProductOfTheTables) {
  std::mt19937 random(51);
  for (int state = 0; state < 20; ++state) {
    const VectorXd q = DrawPositions(model_, &random);
    EXPECT_TRUE(MatrixNear(CalcPose("rf1_tip", q), CalcR1(q), kRounding));
    EXPECT_TRUE(MatrixNear(CalcPose("lf4_tip", q), CalcL4(q), kRounding));
    // A loop with another finger, and joints in another order, are seen.
    EXPECT_GT((CalcPose("rf2_tip", q) - CalcR1(q)).norm(), kVisible);
    VectorXd swapped = q;
    std::swap(swapped[47], swapped[48]);
    EXPECT_GT((CalcPose("lf4_tip", swapped) - CalcL4(q)).norm(), kVisible);
  }
}

// With q' = 0 the robot stands upright and looks along x, its arms hang, each palm's z axis points down.
TEST_F(FingertipPose, AtHomeIsUprightWithArmsHanging) {
  const VectorXd home = VectorXd::Zero(model_.num_positions());
  const double shoulder_height = kWheelRadius + kL1 + kL2 + kL3;       // 1.13 m
  const double palm_height = shoulder_height - kL5 - kL6 - kL7 - kL8;  // 0.52 m
  const double tip_height = palm_height - 0.050 - kHf1 - kHf2 - kHf3 - kHf4;
  EXPECT_NEAR(tip_height, 0.37481, 1e-15);
  // The palm's axes: X to the right (-y), Y to the back (-x), Z down.
  Matrix4d palm = Translate(0.0, -(kL3p + kL4), palm_height);
  palm.topLeftCorner<3, 3>() << 0, -1, 0, -1, 0, 0, 0, 0, -1;
  EXPECT_TRUE(MatrixNear(CalcPose("r_palm_frame", home), palm, kRounding));
  palm(1, 3) = kL3p + kL4;
  EXPECT_TRUE(MatrixNear(CalcPose("l_palm_frame", home), palm, kRounding));
  // R1: 50 mm behind and 28 mm to the left of the right palm's axis; L4, the thumb, 50 mm before the left
  // one's.
  EXPECT_TRUE(MatrixNear(CalcPose("rf1_tip", home).topRightCorner<3, 1>(),
                         Vector3d(-0.050, -0.220 + 0.028, tip_height), kRounding));
  EXPECT_TRUE(MatrixNear(CalcPose("lf4_tip", home).topRightCorner<3, 1>(), Vector3d(0.050, 0.220, tip_height),
                         kRounding));
}

}  // namespace
}  // namespace dexcheck::testing::fingertip_pose_test
