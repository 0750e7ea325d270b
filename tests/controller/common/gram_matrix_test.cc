#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "controller/common/block_cholesky.h"
#include "tests/common/matrix_near.h"

namespace dexcheck::testing::gram_matrix_test {
namespace {

// Sums of some tens of products of numbers below 3, and condition numbers of some tens.
constexpr double kRounding = 1e-13;

RowMatrixXd DrawPadded(Eigen::Index rows, Eigen::Index width, std::mt19937* random) {
  std::normal_distribution<double> normal;
  RowMatrixXd H = RowMatrixXd::Zero(rows, PadToGramBlock(width));
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index k = 0; k < width; ++k) H(i, k) = normal(*random);
  }
  return H;
}

TEST(GramMatrix, IsTheDenseProductOfTheListedRows) {
  constexpr Eigen::Index kAllRows = 20;
  std::mt19937 random(1);
  for (Eigen::Index width = 1; width <= 13; ++width) {
    const RowMatrixXd H = DrawPadded(kAllRows, width, &random);
    const RowMatrixXd weight = DrawPadded(kAllRows, kAllRows, &random).leftCols(kAllRows);
    const RowMatrixXd W_H = (weight + weight.transpose()) * H;
    std::vector<int> rows(static_cast<size_t>(kAllRows));
    std::iota(rows.begin(), rows.end(), 0);
    MatrixXd A = MatrixXd::Constant(H.cols(), H.cols(), 7.0);  // what was there before does not matter
    CalcGramMatrix(H, W_H, rows, &A);
    const MatrixXd expected = H.transpose() * W_H;
    ASSERT_GT(expected.norm(), 1.0);
    EXPECT_TRUE(MatrixNear(MatrixXd(A.triangularView<Eigen::Lower>()),
                           MatrixXd(expected.triangularView<Eigen::Lower>()), kRounding * expected.norm()));

    rows = {3, 4, 11, 19};
    CalcGramMatrix(H, rows, &A);
    MatrixXd few(4, H.cols());
    for (Eigen::Index i = 0; i < 4; ++i) few.row(i) = H.row(rows[static_cast<size_t>(i)]);
    EXPECT_TRUE(MatrixNear(MatrixXd(A.triangularView<Eigen::Lower>()),
                           MatrixXd((few.transpose() * few).triangularView<Eigen::Lower>()),
                           kRounding * few.squaredNorm()));
  }
}

TEST(BlockCholesky, SolvesAndKnowsTheInversesNorm) {
  std::mt19937 random(2);
  for (Eigen::Index k = 1; k <= 13; ++k) {
    const MatrixXd half = DrawPadded(k + 5, k, &random).leftCols(k);
    const MatrixXd A = half.transpose() * half + MatrixXd::Identity(k, k);
    // Above the diagonal, and in rows and columns behind k, is what must not be read.
    MatrixXd padded = MatrixXd::Constant(PadToGramBlock(k), PadToGramBlock(k), 7.0);
    padded.topLeftCorner(k, k).triangularView<Eigen::Lower>() = A;
    BlockCholesky factor(k);
    ASSERT_TRUE(factor.Factor(padded));
    VectorXd x = DrawPadded(k, 1, &random).col(0);
    const VectorXd expected = A.llt().solve(x);
    factor.Solve(x);
    EXPECT_TRUE(MatrixNear(x, expected, kRounding));
    const MatrixXd L = A.llt().matrixL();
    for (Eigen::Index i = 0; i < k; ++i) EXPECT_NEAR(factor.pivot(i), L(i, i), kRounding * L(i, i));
    EXPECT_NEAR(factor.CalcInverseNorm(), MatrixXd(L.inverse()).norm(), kRounding);
    // As by Factor anew.
    ASSERT_TRUE(factor.Factor(A));
    EXPECT_NEAR(factor.CalcInverseNorm(), MatrixXd(L.inverse()).norm(), kRounding);
  }
}

TEST(BlockCholesky, RefusesWhatIsNotPositiveDefinite) {
  for (const Eigen::Index bad : {0, 3, 4, 8}) {
    MatrixXd A = MatrixXd::Identity(9, 9);
    BlockCholesky factor(9);
    ASSERT_TRUE(factor.Factor(A));
    for (const double entry : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
      A(bad, bad) = entry;
      EXPECT_FALSE(factor.Factor(A)) << bad << " " << entry;
    }
  }
}

}  // namespace
}  // namespace dexcheck::testing::gram_matrix_test
