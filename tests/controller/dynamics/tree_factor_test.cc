#include "controller/dynamics/tree_factor.h"

#include <gtest/gtest.h>

#include <random>

#include "controller/dynamics/model_terms.h"
#include "tests/common/paper_robot.h"
#include "tests/common/random_robot.h"

namespace dexcheck::testing::tree_factor_test {
namespace {

// Rounding: some n eps times the condition of M, about 1e6 with phalanges beside the platform.
constexpr double kTolerance = 1e-9;

void ExpectFactors(const RobotModel& model, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  ModelTerms terms(model, Coordinates::kReduced);
  const int n = terms.size();
  ASSERT_GT(n, 0);
  VectorXd q(model.num_positions());
  for (double& value : q) value = uniform(random);
  terms.SetState(q, VectorXd::Zero(n));
  terms.CalcDynamics();
  TreeFactor factor(model);
  factor.Compute(terms.M());

  RowMatrixXd F(n, 3);
  for (Eigen::Index i = 0; i < F.size(); ++i) F.data()[i] = uniform(random);
  const MatrixXd expected = F.transpose() * terms.M().llt().solve(MatrixXd(F));
  RowMatrixXd half = F;
  factor.SolveTransposedColumns(half);
  const double scale = expected.cwiseAbs().maxCoeff();
  EXPECT_LE((half.transpose() * half - expected).cwiseAbs().maxCoeff(), kTolerance * scale);

  const VectorXd a = F.col(0);
  VectorXd La = a;
  factor.Multiply(La);
  EXPECT_NEAR(La.squaredNorm(), a.dot(terms.M() * a), kTolerance * a.dot(terms.M() * a));
  factor.Solve(La);
  EXPECT_LE((La - a).cwiseAbs().maxCoeff(), kTolerance * a.cwiseAbs().maxCoeff());

  VectorXd x = F.col(0);
  factor.SolveTransposed(x);
  EXPECT_LE((x - half.col(0)).norm(), kTolerance * half.col(0).norm());
  VectorXd work;
  EXPECT_DOUBLE_EQ(factor.CalcForceNorm(F.col(0), &work), x.norm());
  factor.Solve(x);
  EXPECT_LE((terms.M() * x - F.col(0)).norm(), kTolerance * F.col(0).norm() * 1e3);
}

TEST(TreeFactor, FactorsMassMatrices) {
  ExpectFactors(ReadPaperRobot(DriveVelocity::kTwist), 1);
  ExpectFactors(ReadPaperRobot(DriveVelocity::kWheelRates), 2);
  for (const BaseType base : {BaseType::kFixed, BaseType::kPlanar, BaseType::kDifferentialDrive}) {
    for (unsigned seed = 1; seed <= 3; ++seed) {
      std::mt19937 random(seed);
      ExpectFactors(RobotModel(MakeRandomRobot({.base = base}, &random)), seed);
    }
  }
}

// The right-hand sides of contacts have zeros at the joints that move no fingertip.
TEST(TreeFactor, SolvesForChainsAlone) {
  const RobotModel model = ReadPaperRobot(DriveVelocity::kTwist);
  ModelTerms terms(model, Coordinates::kReduced);
  const int n = terms.size();
  std::mt19937 random(4);
  terms.SetState(DrawPositions(model, &random), VectorXd::Zero(n));
  terms.CalcDynamics();
  TreeFactor factor(model);
  factor.Compute(terms.M());
  std::vector<int> rows = {0, 1};
  const int tip = model.frame(model.fingertips()[1]).link;
  for (int i = tip; i >= 0; i = model.joint(i).parent) {
    rows.insert(rows.begin() + 2, 2 + i);
  }
  ASSERT_LT(static_cast<int>(rows.size()), n / 2);
  RowMatrixXd F = RowMatrixXd::Zero(n, 3);
  for (const int row : rows) F.row(row) = Vector3d::Random().transpose();
  RowMatrixXd whole = F;
  factor.SolveTransposedColumns(whole);
  factor.SolveTransposedColumns(rows, F);
  ASSERT_GT(whole.norm(), 1e-3);
  EXPECT_TRUE(F == whole);
}

TEST(TreeFactor, RefusesMatricesThatAreNotPositiveDefinite) {
  const RobotModel model = ReadPaperRobot(DriveVelocity::kTwist);
  TreeFactor factor(model);
  MatrixXd M = MatrixXd::Identity(50, 50);
  M(7, 7) = -1.0;
  EXPECT_THROW(factor.Compute(M), std::invalid_argument);
  EXPECT_THROW(factor.Compute(MatrixXd::Identity(49, 49)), std::invalid_argument);
}

}  // namespace
}  // namespace dexcheck::testing::tree_factor_test
