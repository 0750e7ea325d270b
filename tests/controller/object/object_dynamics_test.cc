#include "controller/object/object_dynamics.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/common/linear_algebra.h"
#include "tests/common/matrix_near.h"
#include "tests/controller/object/object_states.h"

namespace dexcheck::testing::object_dynamics_test {
namespace {

// Terms up to 30 (N_o 20 N), tens of operations: 20 eps * 30.
constexpr double kRounding = 1e-13;
// Central differences of terms up to 10 with kStep: truncation kStep^2 / 6 times third derivatives, rounding
// eps * 10 / kStep. Measured 3.3e-10.
constexpr double kStep = 1e-5, kDifference = 3e-9;
// Second differences of order 4 with h = 3e-3: h^4 / 90 = 9e-13 times sixth derivatives (some hundreds),
// rounding eps / h^2 = 2.5e-11 times lever arms and sums. Measured 2.4e-10.
constexpr double kParticles = 2e-9;
// Least error of a mutated model.
constexpr double kVisible = 1e-2;

ObjectTerms CalcTerms(const ObjectState& state) {
  return CalcObjectTerms(MakeObject(), kGravity, state.X_o, state.X_o_dot);
}

// F_o = M_o X_o_ddot + C_o X_o_dot + N_o, equation (19).
Vector6d CalcWrench(const ObjectTerms& terms, const ObjectState& state) {
  return terms.M_o * state.X_o_ddot + terms.C_o * state.X_o_dot + terms.N_o;
}

// Calculates the wrench by Newton's second law for six particles that together have the object's mass
// properties. Accelerations are second differences of positions, order 4; no angular velocity, no P, no
// inertia matrix.
Vector6d CalcWrenchOnParticles(const ObjectState& state) {
  constexpr double h = 3e-3;
  constexpr std::array kWeights = {-1.0 / 12, 16.0 / 12, -30.0 / 12, 16.0 / 12, -1.0 / 12};
  const double m = MakeObject().mass / 6;
  const Matrix3d R_oB = RotationByEigen(state.X_o).transpose();
  Vector6d F_o = Vector6d::Zero();
  for (int i = 0; i < 3; ++i) {
    // m/6 at +-d e_i: I_i = (m/3) (d_j^2 + d_k^2)  =>  d_i^2 = 3 (I_j + I_k - I_i) / (2 m)
    const double d = std::sqrt((kPrincipalMoments.sum() - 2 * kPrincipalMoments[i]) / (4 * m));
    for (const double side : {-d, d}) {
      const Vector3d r = side * PrincipalAxes().col(i);
      Vector3d acceleration = Vector3d::Zero();
      for (int k = 0; k < 5; ++k) {
        const Vector6d X_o = MoveBy(state, (k - 2) * h);
        acceleration +=
            kWeights[static_cast<size_t>(k)] * (X_o.head<3>() + RotationByEigen(X_o) * r) / (h * h);
      }
      const Vector3d force = R_oB * (m * (acceleration - kGravity));
      F_o.head<3>() += force;
      F_o.tail<3>() += r.cross(force);
    }
  }
  return F_o;
}

TEST(ObjectDynamics, ByHand) {
  // beta = pi/2, alpha_dot = 2, gamma_dot = 3, I_o = diag(1, 2, 4): omega = (-2, 0, 3).
  MassProperties object;
  object.mass = 2.0;
  object.inertia = Vector3d(1, 2, 4).asDiagonal();
  Vector6d X_o;
  X_o << 1, 2, 3, 0, kPi / 2, 0;
  Vector6d X_o_dot;
  X_o_dot << 5, 0, 0, 2, 0, 3;
  const ObjectTerms terms = CalcObjectTerms(object, {0, 0, -9.81}, X_o, X_o_dot);
  // World x is the object's z.
  Vector6d V_Bo;
  V_Bo << 0, 0, 5, -2, 0, 3;
  EXPECT_TRUE(MatrixNear(terms.V_Bo, V_Bo, kRounding));
  Matrix6d M_o = Matrix6d::Zero();
  M_o.topLeftCorner<3, 3>() << 0, 0, -2, 0, 2, 0, 2, 0, 0;
  M_o.bottomRightCorner<3, 3>() << -1, 0, 0, 0, 2, 0, 0, 0, 4;
  EXPECT_TRUE(MatrixNear(terms.M_o, M_o, kRounding));
  // A constant velocity in the world needs no force. omega_dot = (0, 6, 0) needs 12 N m about y,
  // omega x I_o omega = (-2, 0, 3) x (-2, 0, 12) = (0, 18, 0).
  Vector6d C_o_X_o_dot;
  C_o_X_o_dot << 0, 0, 0, 0, 30, 0;
  EXPECT_TRUE(MatrixNear(terms.C_o * X_o_dot, C_o_X_o_dot, kRounding));
  // The object's x axis points down: holding it takes 19.62 N along -x.
  Vector6d N_o;
  N_o << -19.62, 0, 0, 0, 0, 0;
  EXPECT_TRUE(MatrixNear(terms.N_o, N_o, kRounding));
  // Energies: (2 * 25 + 1 * 4 + 4 * 9) / 2 = 45; 2 * 9.81 * 3.
  EXPECT_NEAR(CalcObjectKineticEnergy(object, terms.V_Bo), 45.0, kRounding);
  EXPECT_NEAR(CalcObjectPotentialEnergy(object, {0, 0, -9.81}, {1, 2, 3}), 58.86, kRounding);
}

TEST(ObjectDynamics, AgreesWithNewtonsLawForParticles) {
  for (const ObjectState& state : MakeObjectStates(5101, 50)) {
    const ObjectTerms terms = CalcTerms(state);
    const Vector6d F_o = CalcWrenchOnParticles(state);
    ASSERT_GT((terms.C_o * state.X_o_dot).norm(), kVisible);
    EXPECT_TRUE(MatrixNear(CalcWrench(terms, state), F_o, kParticles));
  }
}

TEST(ObjectDynamics, BothFormsAgree) {
  for (const ObjectState& state : MakeObjectStates(5103, 50)) {
    const ObjectTerms terms = CalcTerms(state);
    const Vector6d V_Bo_dot = terms.P_inv * state.X_o_ddot + terms.P_inv_dot * state.X_o_dot;
    const ObjectBodyTerms body =
        CalcObjectBodyTerms(MakeObject(), kGravity, RotationByEigen(state.X_o), terms.V_Bo);
    EXPECT_TRUE(MatrixNear(body.M_hat * V_Bo_dot + body.C_hat * terms.V_Bo + body.N_o,
                           CalcWrench(terms, state), kRounding));
    EXPECT_TRUE(MatrixNear(body.C_hat, -body.C_hat.transpose(), kRounding));
  }
}

// M_o of (19) is no inertia matrix in X_o. P^-T M_o is: of T = X_o_dot^T (P^-T M_o) X_o_dot / 2.
Matrix6d CalcLagrangeMass(const Vector6d& X_o) {
  const ObjectTerms terms = CalcObjectTerms(MakeObject(), kGravity, X_o, Vector6d::Zero());
  return terms.P_inv.transpose() * terms.M_o;
}

TEST(ObjectDynamics, MassMatrixIsSymmetricOnlyInLagrangeForm) {
  for (const ObjectState& state : MakeObjectStates(5104, 50)) {
    const ObjectTerms terms = CalcTerms(state);
    EXPECT_GT((terms.M_o - terms.M_o.transpose()).norm(), kVisible);
    const Matrix6d M_X = CalcLagrangeMass(state.X_o);
    EXPECT_TRUE(MatrixNear(M_X, M_X.transpose(), kRounding));
    EXPECT_GT(CalcEigenvalues(M_X.selfadjointView<Eigen::Lower>().toDenseMatrix()).real().minCoeff(), 1e-3);
    EXPECT_NEAR(0.5 * state.X_o_dot.dot(M_X * state.X_o_dot),
                CalcObjectKineticEnergy(MakeObject(), terms.V_Bo), kRounding * TolScale());
  }
}

TEST(ObjectDynamics, LagrangeFormHasProperty2) {
  for (const ObjectState& state : MakeObjectStates(5105, 50)) {
    const ObjectTerms terms = CalcTerms(state);
    const Matrix6d M_X_dot = (CalcLagrangeMass(state.X_o + kStep * state.X_o_dot) -
                              CalcLagrangeMass(state.X_o - kStep * state.X_o_dot)) /
                             (2 * kStep);
    const Matrix6d skew = M_X_dot - 2 * terms.P_inv.transpose() * terms.C_o;
    ASSERT_GT(M_X_dot.norm(), kVisible);
    EXPECT_TRUE(MatrixNear(skew, -skew.transpose(), kDifference));
    // With [omega]x I_o, which gives the same torque, the property is lost: the choice of C_hat matters.
    ObjectBodyTerms other = terms.body;
    other.C_hat.bottomRightCorner<3, 3>() = Skew(terms.V_Bo.tail<3>()) * MakeObject().inertia;
    const Matrix6d C_other = other.M_hat * terms.P_inv_dot + other.C_hat * terms.P_inv;
    EXPECT_TRUE(MatrixNear(C_other * state.X_o_dot, terms.C_o * state.X_o_dot, kRounding));
    const Matrix6d not_skew = M_X_dot - 2 * terms.P_inv.transpose() * C_other;
    EXPECT_GT((not_skew + not_skew.transpose()).norm(), kVisible);
  }
}

TEST(ObjectDynamics, TermsAreFiniteWhereZyzIsSingular) {
  ObjectState state;
  state.X_o << 1, 2, 3, 0.4, 0.0, -0.7;
  state.X_o_dot << 0.1, 0.2, 0.3, 0.4, 0.5, 0.6;
  state.X_o_ddot << 0.3, 0.2, 0.1, 0.6, 0.5, 0.4;
  const ObjectTerms terms = CalcTerms(state);
  EXPECT_TRUE(MatrixNear(CalcWrench(terms, state), CalcWrenchOnParticles(state), kParticles));
  EXPECT_EQ(CalcRank(terms.M_o), 5);
}

}  // namespace
}  // namespace dexcheck::testing::object_dynamics_test
