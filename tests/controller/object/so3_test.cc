#include "controller/object/so3.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <random>
#include <stdexcept>

#include "tests/common/matrix_near.h"

namespace dexcheck::testing::so3_test {
namespace {

// Entries up to pi, about ten operations each: 20 eps.
constexpr double kRounding = 5e-15;
// Products of Jacobians with their inverses: entries up to pi/2, and a difference that loses one digit.
constexpr double kJacobianRounding = 2e-14;
// Central differences with kStep: truncation kStep^2 times third derivatives (< 10 here), rounding eps /
// kStep.
constexpr double kStep = 1e-5, kDifference = 1e-9;
// Least error of a mutated model.
constexpr double kVisible = 1e-3;

// Around the switch to series at 0.1 rad, and up to pi.
constexpr std::array kAngles = {0.0,       1e-300, 1e-12, 1e-8,       1e-4,       0.0999999,
                                0.1000001, 1.0,    2.5,   kPi - 1e-4, kPi - 1e-8, kPi - 1e-12};

class Random {
 public:
  explicit Random(unsigned seed) : generator_(seed) {}
  Vector3d Vector(double size) {
    return {size * uniform_(generator_), size * uniform_(generator_), size * uniform_(generator_)};
  }
  Vector3d Axis() { return Vector(1.0).normalized(); }

 private:
  std::mt19937 generator_;
  std::uniform_real_distribution<double> uniform_{-1.0, 1.0};
};

Matrix3d RotationByEigen(const Vector3d& phi) {
  const double theta = phi.norm();
  if (theta == 0.0) return Matrix3d::Identity();
  return Eigen::AngleAxisd(theta, phi / theta).toRotationMatrix();
}

TEST(So3, ExpAgreesWithAngleAxis) {
  Random random(3101);
  for (const double angle : kAngles) {
    const Vector3d phi = angle * random.Axis();
    EXPECT_TRUE(MatrixNear(ExpSo3(phi), RotationByEigen(phi), kRounding)) << "angle " << angle;
  }
}

TEST(So3, LogInvertsExpFromZeroToPi) {
  Random random(3102);
  for (const double angle : kAngles) {
    for (int i = 0; i < 10; ++i) {
      const Vector3d phi = angle * random.Axis();
      EXPECT_TRUE(MatrixNear(LogSo3(ExpSo3(phi)), phi, kRounding)) << "angle " << angle;
    }
  }
}

TEST(So3, LogKeepsTheRelativeAccuracyOfSmallAngles) {
  const Vector3d phi(3e-9, -2e-9, 1e-9);
  EXPECT_TRUE(MatrixNear(1e9 * LogSo3(ExpSo3(phi)), 1e9 * phi, kRounding));
}

TEST(So3, LogOfAHalfTurnPicksOneSign) {
  Random random(3103);
  for (int i = 0; i < 20; ++i) {
    Vector3d axis = random.Axis();
    Eigen::Index largest = 0;
    axis.cwiseAbs().maxCoeff(&largest);
    if (axis[largest] < 0.0) axis = -axis;
    const Matrix3d half_turn = 2.0 * axis * axis.transpose() - Matrix3d::Identity();
    EXPECT_TRUE(MatrixNear(LogSo3(half_turn), kPi * axis, kRounding));
  }
}

TEST(So3, JacobianIdentities) {
  Random random(3105);
  for (const double angle : kAngles) {
    const Vector3d phi = angle * random.Axis();
    const Matrix3d J_l = CalcLeftJacobian(phi);
    EXPECT_TRUE(MatrixNear(J_l * CalcLeftJacobianInverse(phi), Matrix3d::Identity(), kJacobianRounding));
    EXPECT_TRUE(MatrixNear(J_l, ExpSo3(phi) * J_l.transpose(), kJacobianRounding));
    EXPECT_TRUE(MatrixNear(CalcLeftJacobian(-phi), J_l.transpose(), kRounding));
    EXPECT_TRUE(MatrixNear(J_l * phi, phi, kRounding));
  }
}

TEST(So3, JacobianMapsRatesToAngularVelocity) {
  Random random(3106);
  for (const double angle : {1e-3, 0.5, 1.7, 3.0}) {
    const Vector3d phi = angle * random.Axis();
    const Vector3d phi_dot = random.Vector(1.0);
    const Matrix3d R_dot = (ExpSo3(phi + kStep * phi_dot) - ExpSo3(phi - kStep * phi_dot)) / (2 * kStep);
    const Matrix3d omega_x = R_dot * ExpSo3(phi).transpose();
    EXPECT_TRUE(MatrixNear(Skew(CalcLeftJacobian(phi) * phi_dot), omega_x, kDifference));
  }
  // The right Jacobian in its place is seen.
  const Vector3d phi(0.4, -0.9, 0.7);
  const Vector3d phi_dot(0.5, 0.8, -0.3);
  EXPECT_GT((CalcLeftJacobian(-phi) * phi_dot - CalcLeftJacobian(phi) * phi_dot).norm(), kVisible);
}

TEST(So3, JacobianDotIsTheDerivativeOfTheJacobian) {
  Random random(3107);
  for (const double angle : {0.0, 1e-6, 0.05, 0.0999, 0.1001, 0.5, 1.7, 3.0}) {
    const Vector3d phi = angle * random.Axis();
    const Vector3d phi_dot = random.Vector(1.0);
    const Matrix3d J_l_dot = CalcLeftJacobianDot(phi, phi_dot);
    const Matrix3d difference =
        (CalcLeftJacobian(phi + kStep * phi_dot) - CalcLeftJacobian(phi - kStep * phi_dot)) / (2 * kStep);
    ASSERT_GT(J_l_dot.norm(), kVisible);
    EXPECT_TRUE(MatrixNear(J_l_dot, difference, kDifference)) << "angle " << angle;
  }
}

TEST(So3, RejectsWhatIsNoRotation) {
  Matrix3d mirror = Matrix3d::Identity();
  mirror(2, 2) = -1.0;
  EXPECT_THROW(LogSo3(mirror), std::invalid_argument);
  EXPECT_THROW(LogSo3(1.001 * Matrix3d::Identity()), std::invalid_argument);
  EXPECT_THROW(LogSo3(Matrix3d::Constant(std::nan(""))), std::invalid_argument);
  EXPECT_THROW(CalcLeftJacobianInverse({0.0, 0.0, 2 * kPi}), std::invalid_argument);
  EXPECT_NO_THROW(LogSo3(ExpSo3({1, 2, 3}).cast<float>().cast<double>()));
}

TEST(OrientationError, DoesNotDependOnTheWorldFrame) {
  Random random(3108);
  for (int i = 0; i < 20; ++i) {
    const Matrix3d R_Bo = ExpSo3(random.Vector(2.0));
    const Matrix3d R_Bd = ExpSo3(random.Vector(2.0));
    const Matrix3d R_WB = ExpSo3(random.Vector(2.0));
    const Vector3d omega_o = random.Vector(1.0);
    const Vector3d omega_d = random.Vector(1.0);
    const OrientationError error = CalcOrientationError(R_Bo, omega_o, R_Bd, omega_d);
    const OrientationError moved = CalcOrientationError(R_WB * R_Bo, omega_o, R_WB * R_Bd, omega_d);
    ASSERT_GT(error.e_R.norm(), kVisible);
    EXPECT_TRUE(MatrixNear(moved.e_R, error.e_R, kJacobianRounding));
    EXPECT_TRUE(MatrixNear(moved.e_R_dot, error.e_R_dot, kJacobianRounding));
    // Applied to the object in its own axes, the error leads to the desired frame.
    EXPECT_TRUE(MatrixNear(R_Bo * ExpSo3(error.e_R), R_Bd, kRounding));
  }
}

TEST(OrientationError, RateIsTheDerivativeOfTheError) {
  Random random(3109);
  for (int i = 0; i < 20; ++i) {
    const Matrix3d R_Bo = ExpSo3(random.Vector(1.0));
    const Matrix3d R_Bd = ExpSo3(random.Vector(1.0));
    const Vector3d omega_o = random.Vector(1.0);
    const Vector3d omega_d = random.Vector(1.0);
    const auto error_at = [&](double t) {
      return CalcOrientationError(R_Bo * ExpSo3(t * omega_o), omega_o, R_Bd * ExpSo3(t * omega_d), omega_d);
    };
    const Vector3d difference = (error_at(kStep).e_R - error_at(-kStep).e_R) / (2 * kStep);
    const OrientationError error = error_at(0.0);
    EXPECT_TRUE(MatrixNear(error.e_R_dot, difference, kDifference));
    // Mutations: the difference of angular velocities in its own axes, and the Jacobian left out.
    EXPECT_GT((omega_d - omega_o - difference).norm(), kVisible);
    EXPECT_GT((error.omega_od - difference).norm(), kVisible);
  }
}

}  // namespace
}  // namespace dexcheck::testing::so3_test
