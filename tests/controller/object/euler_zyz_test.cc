#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "controller/common/errors.h"
#include "controller/object/so3.h"
#include "tests/common/matchers.h"
#include "tests/common/matrix_near.h"
#include "tests/common/throws.h"
#include "tests/controller/object/object_states.h"

namespace dexcheck::testing::euler_zyz_test {
namespace {

// Entries up to 1, a few operations each: 20 eps.
constexpr double kRounding = 5e-15;
// Angles up to 8 rad taken back from a rotation with |sin(beta)| >= 0.3, and P with entries up to 1 / 0.3.
constexpr double kInverseRounding = 3e-14;
// Central differences with kStep: truncation kStep^2 / 6 times third derivatives (below 30), rounding eps /
// kStep.
constexpr double kStep = 1e-5, kDifference = 5e-10;
// Least error of a mutated model.
constexpr double kVisible = 1e-2;

// [v; omega] of the motion X_o + t X_o_dot at t = 0 from poses alone: v = R^T p_dot, [omega]x = R^T R_dot.
Vector6d CalcBodyVelocityByDifference(const ObjectState& state) {
  const Vector6d before = state.X_o - kStep * state.X_o_dot;
  const Vector6d after = state.X_o + kStep * state.X_o_dot;
  const Matrix3d R = RotationByEigen(state.X_o);
  const Matrix3d omega_x = R.transpose() * (RotationByEigen(after) - RotationByEigen(before)) / (2 * kStep);
  Vector6d V_Bo;
  V_Bo << R.transpose() * state.X_o_dot.head<3>(), omega_x(2, 1), omega_x(0, 2), omega_x(1, 0);
  return V_Bo;
}

TEST(EulerZyz, RotationIsTheProductOfElementaryRotations) {
  for (const ObjectState& state : MakeObjectStates(4101, 50)) {
    EXPECT_TRUE(MatrixNear(CalcRotationZyz(state.X_o.tail<3>()), RotationByEigen(state.X_o), kRounding));
    // Mutation: beta turned the other way.
    EXPECT_GT(
        (CalcRotationZyz({state.X_o[3], -state.X_o[4], state.X_o[5]}) - RotationByEigen(state.X_o)).norm(),
        kVisible);
  }
}

TEST(EulerZyz, AnglesFollowThePreviousOnes) {
  // The angles come back on their own branch and turn from angles 0.3 rad away, in any direction.
  const Vector3d offset(0.2, -0.15, 0.15);
  bool seen_negative_beta = false;
  for (const ObjectState& state : MakeObjectStates(4102, 100)) {
    const Vector3d zyz = state.X_o.tail<3>();
    const Matrix3d R = RotationByEigen(state.X_o);
    EXPECT_TRUE(MatrixNear(CalcZyzAngles(R, zyz + offset), zyz, kInverseRounding));
    EXPECT_TRUE(MatrixNear(CalcZyzAngles(R, zyz - offset), zyz, kInverseRounding));
    seen_negative_beta = seen_negative_beta || zyz[1] < 0.0;
  }
  EXPECT_TRUE(seen_negative_beta);
}

TEST(EulerZyz, PrincipalAnglesLieInTheirRange) {
  for (const ObjectState& state : MakeObjectStates(4103, 100)) {
    const Matrix3d R = RotationByEigen(state.X_o);
    const Vector3d zyz = CalcZyzAngles(R);
    EXPECT_GT(zyz[1], 0.0);
    EXPECT_LT(zyz[1], kPi);
    EXPECT_LE(std::abs(zyz[0]), kPi);
    EXPECT_LE(std::abs(zyz[2]), kPi);
    EXPECT_TRUE(MatrixNear(CalcRotationZyz(zyz), R, kRounding));
  }
}

TEST(EulerZyz, PInverseGivesTheBodyVelocity) {
  for (const ObjectState& state : MakeObjectStates(4105, 50)) {
    const Vector6d V_Bo = CalcBodyVelocityByDifference(state);
    ASSERT_GT(V_Bo.tail<3>().norm(), kVisible);
    EXPECT_TRUE(MatrixNear(CalcPInverse(state.X_o) * state.X_o_dot, V_Bo, kDifference));
    // Mutations: the rates of the XYZ-like order (alpha and gamma exchanged), and world instead of object
    // axes.
    Vector6d exchanged = state.X_o;
    std::swap(exchanged[3], exchanged[5]);
    EXPECT_GT((CalcPInverse(exchanged) * state.X_o_dot - V_Bo).norm(), kVisible);
    Vector6d V_world = V_Bo;
    V_world.tail<3>() = RotationByEigen(state.X_o) * V_Bo.tail<3>();
    EXPECT_GT((CalcPInverse(state.X_o) * state.X_o_dot - V_world).norm(), 1e-4);
  }
}

TEST(EulerZyz, PInverseDotIsTheDerivativeOfPInverse) {
  for (const ObjectState& state : MakeObjectStates(4106, 50)) {
    const Matrix6d difference =
        (CalcPInverse(state.X_o + kStep * state.X_o_dot) - CalcPInverse(state.X_o - kStep * state.X_o_dot)) /
        (2 * kStep);
    const Matrix6d P_inv_dot = CalcPInverseDot(state.X_o, state.X_o_dot);
    ASSERT_GT(P_inv_dot.norm(), kVisible);
    EXPECT_TRUE(MatrixNear(P_inv_dot, difference, kDifference));
    // Mutation: the sign of [omega]x in d/dt R^T.
    Matrix6d mutated = P_inv_dot;
    mutated.topLeftCorner<3, 3>() *= -1.0;
    EXPECT_GT((mutated - difference).norm(), kVisible);
  }
}

TEST(EulerZyz, PInverseIsRegularWhereTheAnglesAreNot) {
  for (const double beta : {0.0, kPi, -kPi, 1e-12}) {
    Vector6d X_o;
    X_o << 1, 2, 3, 0.4, beta, -0.7;
    Vector6d X_o_dot;
    X_o_dot << 0.1, 0.2, 0.3, 0.4, 0.5, 0.6;
    EXPECT_TRUE(CalcPInverse(X_o).allFinite());
    EXPECT_TRUE(CalcPInverseDot(X_o, X_o_dot).allFinite());
    EXPECT_TRUE(MatrixNear(CalcPInverse(X_o) * X_o_dot, CalcBodyVelocityByDifference({X_o, X_o_dot, {}}),
                           kDifference));
    EXPECT_THROW(CalcP(X_o), SingularityError);
    EXPECT_THROW(CalcZyzAngles(CalcRotationZyz(X_o.tail<3>())), SingularityError);
  }
}

TEST(EulerZyz, SingularityErrorNamesBeta) {
  Vector6d X_o;
  X_o << 1, 2, 3, 0.4, 2e-5, -0.7;
  EXPECT_THAT(MessageOf<SingularityError>([&] { return CalcP(X_o); }),
              HasSubstr("beta = 2e-05 rad, sin(beta) = 2e-05, needed |sin(beta)| >= 0.001"));
  const Matrix3d R = CalcRotationZyz({0.4, kPi - 2e-5, -0.7});
  EXPECT_THAT(MessageOf<SingularityError>([&] {
                return CalcZyzAngles(R, {0.4, 3.0, -0.7});
              }),
              HasSubstr("beta = 3.14157265 rad, sin(beta) = 2e-05"));
}

TEST(EulerZyz, WorksUpToTheThreshold) {
  // Just outside the threshold the angles are still good to eps / sin(beta) = 2e-13.
  constexpr double kNearSingular = 2e-12;
  for (const double beta : {1.01 * kMinSinBeta, kPi - 1.01 * kMinSinBeta, -1.01 * kMinSinBeta}) {
    const Vector3d zyz(0.4, beta, -0.7);
    EXPECT_TRUE(MatrixNear(CalcZyzAngles(CalcRotationZyz(zyz), zyz), zyz, kNearSingular));
    Vector6d X_o;
    X_o << 1, 2, 3, zyz;
    EXPECT_TRUE(MatrixNear(CalcP(X_o) * CalcPInverse(X_o), Matrix6d::Identity(), kNearSingular));
    X_o[4] = beta > 1.0 ? kPi - 0.99 * kMinSinBeta : std::copysign(0.99 * kMinSinBeta, beta);
    EXPECT_THROW(CalcP(X_o), SingularityError);
  }
}

}  // namespace
}  // namespace dexcheck::testing::euler_zyz_test
