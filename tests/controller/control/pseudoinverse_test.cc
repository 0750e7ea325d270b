// J^+ and N of (47): worked example, Moore-Penrose properties, least W-norm, singular matrices.

#include "controller/control/pseudoinverse.h"

#include <gtest/gtest.h>

#include <random>

#include "controller/common/errors.h"
#include "tests/common/linear_algebra.h"
#include "tests/common/matrix_near.h"
#include "tests/common/throws.h"

namespace dexcheck::testing::pseudoinverse_test {
namespace {

constexpr Eigen::Index kRows = 12;
constexpr Eigen::Index kColumns = 50;

// Random matrices have condition numbers of a few units, random W of up to 1e3: eps times their product, with
// room.
constexpr double kRounding = 1e-12;

MatrixXd DrawMatrix(Eigen::Index rows, Eigen::Index columns, std::mt19937* random) {
  std::normal_distribution<double> normal;
  MatrixXd A(rows, columns);
  for (double& entry : A.reshaped()) entry = normal(*random);
  return A;
}

/// J, one of the three kinds of W, and the pseudoinverse factored.
struct Case {
  Case(int kind, std::mt19937* random)
      : J(DrawMatrix(kRows, kColumns, random)), J_pinv("J", kRows, kColumns) {
    const MatrixXd A = DrawMatrix(kColumns, kColumns, random);
    switch (kind) {
      case 0:
        W = MatrixXd::Identity(kColumns, kColumns);
        J_pinv.Factor(J);
        break;
      case 1: {
        const VectorXd w = A.col(0).cwiseAbs() + VectorXd::Constant(kColumns, 0.1);
        W = w.asDiagonal();
        J_pinv.FactorDiagonal(J, w);
        break;
      }
      default:
        W = A * A.transpose() / kColumns + 0.1 * MatrixXd::Identity(kColumns, kColumns);
        J_pinv.FactorWeighted(J, W);
    }
  }
  MatrixXd J;
  MatrixXd W;
  Pseudoinverse J_pinv;
};

TEST(Pseudoinverse, ByHand) {
  // J = [1 1], W = diag(1, 3): J W^-1 J^T = 4/3, J^+ = [3/4; 1/4].
  const Eigen::RowVector2d J(1.0, 1.0);
  Pseudoinverse pinv("J", 1, 2);
  pinv.FactorDiagonal(J, Vector2d(1.0, 3.0));
  EXPECT_TRUE(MatrixNear(pinv.CalcMatrix(), Vector2d(0.75, 0.25), 1e-15));
  pinv.Factor(J);
  EXPECT_TRUE(MatrixNear(pinv.CalcMatrix(), Vector2d(0.5, 0.5), 1e-15));
  EXPECT_NEAR(pinv.condition_number(), 1.0, 1e-15);
  VectorXd x = Vector2d(1.0, 0.0);
  pinv.Project(x);
  EXPECT_TRUE(MatrixNear(x, Vector2d(0.5, -0.5), 1e-15));
}

TEST(Pseudoinverse, IsARightInverseWithANullSpaceProjector) {
  std::mt19937 random(1);
  for (int kind = 0; kind < 3; ++kind) {
    Case c(kind, &random);
    const MatrixXd J_plus = c.J_pinv.CalcMatrix();
    const MatrixXd N = c.J_pinv.CalcProjector();
    ASSERT_GT(N.norm(), 1.0);
    EXPECT_TRUE(MatrixNear(c.J * J_plus, MatrixXd::Identity(kRows, kRows), kRounding));
    EXPECT_TRUE(MatrixNear(N * J_plus, MatrixXd::Zero(kColumns, kRows), kRounding));
    EXPECT_TRUE(MatrixNear(c.J * N, MatrixXd::Zero(kRows, kColumns), kRounding));
    EXPECT_TRUE(MatrixNear(N * N, N, kRounding));
    // N is the projector that is orthogonal in W.
    EXPECT_TRUE(MatrixNear(c.W * N, N.transpose() * c.W, kRounding));
    // Both are applied without being formed.
    const VectorXd y = DrawMatrix(kRows, 1, &random);
    VectorXd x(kColumns), projected = DrawMatrix(kColumns, 1, &random);
    c.J_pinv.Apply(y, x);
    EXPECT_TRUE(MatrixNear(x, J_plus * y, kRounding));
    const VectorXd expected = N * projected;
    c.J_pinv.Project(projected);
    EXPECT_TRUE(MatrixNear(projected, expected, kRounding));
  }
}

// Columns that are zero need not be looked at, also when they are others than before.
TEST(Pseudoinverse, ColumnsThatAreNotListedAreZero) {
  std::mt19937 random(12);
  const MatrixXd whole = DrawMatrix(kRows, kColumns, &random);
  const VectorXd w = DrawMatrix(kColumns, 1, &random).cwiseAbs() + VectorXd::Constant(kColumns, 0.1);
  const VectorXd y = DrawMatrix(kRows, 1, &random);
  const VectorXd z = DrawMatrix(kColumns, 1, &random);
  Pseudoinverse listed("J", kRows, kColumns), all("J", kRows, kColumns);
  for (const int first : {0, 17}) {
    std::vector<int> columns;
    for (int i = first; i < kColumns; i += 2) columns.push_back(i);
    MatrixXd J = MatrixXd::Zero(kRows, kColumns);
    for (const int i : columns) J.col(i) = whole.col(i);
    for (const bool diagonal : {false, true}) {
      if (diagonal) {
        listed.FactorDiagonal(J, w, columns);
        all.FactorDiagonal(J, w);
      } else {
        listed.Factor(J, columns);
        all.Factor(J);
      }
      const MatrixXd expected = all.CalcMatrix();
      ASSERT_GT(expected.norm(), 0.1);
      EXPECT_TRUE(MatrixNear(listed.CalcMatrix(), expected, kRounding));
      EXPECT_TRUE(MatrixNear(listed.CalcProjector(), all.CalcProjector(), kRounding));
      VectorXd x(kColumns), projected = z;
      listed.Apply(y, x);
      EXPECT_TRUE(MatrixNear(x, expected * y, kRounding));
      listed.Project(projected);
      EXPECT_TRUE(MatrixNear(projected, all.CalcProjector() * z, kRounding));
    }
    // All columns, after some.
    listed.Factor(whole);
    EXPECT_TRUE(MatrixNear(whole * listed.CalcMatrix(), MatrixXd::Identity(kRows, kRows), kRounding));
  }
}

TEST(Pseudoinverse, ConditionNumberIsABound) {
  std::mt19937 random(6);
  for (int kind = 0; kind < 3; ++kind) {
    Case c(kind, &random);
    const Eigen::LLT<MatrixXd> W_llt(c.W);
    const MatrixXd half = W_llt.matrixL().solve(c.J.transpose());
    const VectorXd sigma = CalcSingularValues(half);
    const double exact = sigma[0] / sigma[kRows - 1];
    EXPECT_GE(c.J_pinv.condition_number(), exact);
    EXPECT_LE(c.J_pinv.condition_number(), kRows * exact);
  }
}

TEST(Pseudoinverse, RejectsRankDeficientMatrices) {
  std::mt19937 random(7);
  MatrixXd J = DrawMatrix(kRows, kColumns, &random);
  Pseudoinverse pinv("J_B'", kRows, kColumns);
  EXPECT_NO_THROW(pinv.Factor(J));
  J.row(3) = J.row(5) + 1e-4 * J.row(7);
  EXPECT_NO_THROW(pinv.Factor(J + 1e-4 * DrawMatrix(kRows, kColumns, &random)));
  J.row(3) = J.row(5) + 2.0 * J.row(7);
  const auto factor = [&] { pinv.Factor(J); };
  EXPECT_TRUE(Throws<SingularityError>(factor, "J_B' has not full row rank, condition number"));
  J.row(3).setZero();
  EXPECT_TRUE(Throws<SingularityError>(factor, "condition number inf"));
  J.setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_TRUE(Throws<SingularityError>(factor, "condition number"));
}

}  // namespace
}  // namespace dexcheck::testing::pseudoinverse_test
