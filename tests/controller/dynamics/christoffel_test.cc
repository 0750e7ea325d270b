// M, C and F of (16) from the energies of the single bodies: C by Christoffel symbols of a naive M, gravity
// by the gradient of the potential energy, friction by that of the dissipation; derivatives by dual numbers.

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/common/dual.h"
#include "tests/common/mass_scaling.h"
#include "tests/common/matrix_near.h"
#include "tests/common/naive_dynamics.h"
#include "tests/controller/dynamics/robot_cases.h"

namespace dexcheck::testing::christoffel_test {
namespace {

// Rounding of sums over 12 joints, on entries scaled to 1 in M and 30 in C; measured 2e-14.
constexpr double kRounding = 2e-13;
// A phalanx's 1e-5 kg m^2 is a difference of moments about the platform's origin, some 1e3 times as large, so
// that much more is lost; measured 1.4e-12.
constexpr double kFingerRounding = 1e-11;
// Energies and momenta add up to some 400 J, kg m/s, kg m^2/s; measured 3e-13.
constexpr double kSumRounding = 2e-12;

std::vector<RobotCase> MakeCases() {
  std::vector<RobotCase> cases;
  std::mt19937 random(316);
  const auto add = [&](const char* name, BaseType base, double branching, double prismatic) {
    const RandomRobotOptions options{
        .base = base, .joints = 12, .branching = branching, .prismatic = prismatic};
    cases.push_back(
        {name, RobotModel(MakeRandomRobot(options, &random)), Coordinates::kUnreduced, kRounding});
  };
  add("FixedChain", BaseType::kFixed, 0.0, 0.0);
  add("FixedTree", BaseType::kFixed, 0.4, 0.3);
  add("PlanarChain", BaseType::kPlanar, 0.0, 0.3);
  add("PlanarTree", BaseType::kPlanar, 0.4, 0.3);
  add("DriveChain", BaseType::kDifferentialDrive, 0.0, 0.0);
  add("DriveTree", BaseType::kDifferentialDrive, 0.4, 0.3);
  cases.push_back({"PaperRobot", ReadPaperRobot(), Coordinates::kUnreduced, kFingerRounding});
  return cases;
}

/// M and C_ij = 1/2 sum_k (dM_ij/dq_k + dM_ik/dq_j - dM_jk/dq_i) q_dot_k of the naive model.
struct LagrangeTerms {
  MatrixXd M;
  MatrixXd C;
  VectorXd gravity;
  VectorXd friction;
};

LagrangeTerms CalcLagrangeTerms(const RobotModel& model, const VectorXd& q, const VectorXd& q_dot) {
  const Eigen::Index n = q.size();
  const NaiveDynamics<double> naive(model, q);
  LagrangeTerms terms{naive.CalcMassMatrix(), MatrixXd::Zero(n, n), VectorXd::Zero(n), VectorXd::Zero(n)};
  for (Eigen::Index k = 0; k < n; ++k) {
    const NaiveDynamics<Dual> along_k(model, MakeDual(q, VectorXd::Unit(n, k)));
    const MatrixXd dM = GetRates(along_k.CalcMassMatrix());
    const VectorXd dM_q_dot = dM * q_dot;
    terms.C += 0.5 * q_dot[k] * dM;
    terms.C.col(k) += 0.5 * dM_q_dot;
    terms.C.row(k) -= 0.5 * dM_q_dot.transpose();
    terms.gravity[k] = along_k.CalcPotentialEnergy().rate;
    terms.friction[k] = naive.CalcDissipation(MakeDual(q_dot, VectorXd::Unit(n, k))).rate;
  }
  return terms;
}

class Christoffel : public ::testing::TestWithParam<RobotCase> {
 protected:
  static constexpr int kStates = 3;
  /// Another state at random.
  void Draw() {
    q_ = DrawPositions(model_, &random_);
    q_dot_ = DrawVelocities(terms_.size(), &random_);
    terms_.SetState(q_, q_dot_);
    terms_.CalcDynamics();
  }
  const RobotModel& model_ = GetParam().model;
  const double tolerance_ = GetParam().tolerance;
  std::mt19937 random_{1905};
  ModelTerms terms_{model_, Coordinates::kUnreduced};
  VectorXd q_, q_dot_;
};

INSTANTIATE_TEST_SUITE_P(Robots, Christoffel, ::testing::ValuesIn(MakeCases()), NameOf);

TEST_P(Christoffel, TermsAreThoseOfLagrange) {
  for (int state = 0; state < kStates; ++state) {
    Draw();
    const LagrangeTerms expected = CalcLagrangeTerms(model_, q_, q_dot_);
    const MatrixXd& M = expected.M;
    const MatrixXd C = ScaleByMass(expected.C, M);
    const VectorXd gravity = ScaleForceByMass(expected.gravity, M);
    const VectorXd friction = ScaleForceByMass(expected.friction, M);
    ASSERT_GT((M - MatrixXd(M.diagonal().asDiagonal())).norm(), 0.1);
    ASSERT_GT(C.cwiseAbs().maxCoeff(), 0.1);
    ASSERT_GT(gravity.cwiseAbs().maxCoeff(), 1.0);
    ASSERT_GT(friction.cwiseAbs().maxCoeff(), 0.01);
    EXPECT_TRUE(MatrixNear(ScaleByMass(terms_.M(), M), ScaleByMass(M, M), tolerance_)) << "M";
    EXPECT_TRUE(MatrixNear(ScaleByMass(terms_.C(), M), C, tolerance_)) << "C";
    EXPECT_TRUE(MatrixNear(ScaleForceByMass(terms_.gravity(), M), gravity, tolerance_)) << "gravity";
    EXPECT_TRUE(MatrixNear(ScaleForceByMass(terms_.friction(), M), friction, tolerance_)) << "friction";
  }
}

TEST_P(Christoffel, EnergyAndMomentumAreSumsOverBodies) {
  for (int state = 0; state < kStates; ++state) {
    Draw();
    const EnergyAndMomentum result = terms_.CalcEnergyAndMomentum();

    const NaiveDynamics<double> naive(model_, q_);
    double mass = 0.0;
    Vector3d moment = Vector3d::Zero();
    Vector3d linear = Vector3d::Zero();
    for (const auto& body : naive.bodies()) {
      mass += body.mass;
      moment += body.mass * body.p;
      linear += body.mass * (body.J_p * q_dot_);
    }
    const Vector3d com = moment / mass;
    Vector3d angular = Vector3d::Zero();
    for (const auto& body : naive.bodies()) {
      angular += (body.p - com).cross(body.mass * (body.J_p * q_dot_)) + body.inertia * (body.J_w * q_dot_);
    }
    const double kinetic = 0.5 * q_dot_.dot(naive.CalcMassMatrix() * q_dot_);
    const double potential = naive.CalcPotentialEnergy();
    ASSERT_GT(linear.norm(), 0.1);
    ASSERT_GT(angular.norm(), 0.1);
    ASSERT_GT(std::abs(potential), 0.1);
    EXPECT_NEAR(result.kinetic, kinetic, kSumRounding * TolScale());
    EXPECT_NEAR(result.potential, potential, kSumRounding * TolScale());
    EXPECT_TRUE(MatrixNear(result.com, com, kSumRounding)) << "com";
    EXPECT_TRUE(MatrixNear(result.linear_momentum, linear, kSumRounding)) << "linear momentum";
    EXPECT_TRUE(MatrixNear(result.angular_momentum, angular, kSumRounding)) << "angular momentum";
  }
}

}  // namespace
}  // namespace dexcheck::testing::christoffel_test
