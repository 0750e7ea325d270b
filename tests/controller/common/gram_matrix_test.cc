#include "controller/common/gram_matrix.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>
#include <vector>

#include "tests/common/matrix_near.h"

namespace dexcheck::testing {
namespace {

// Sums of some tens of products of numbers below 3, and inverses of triangles that are near the identity.
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

TEST(GramMatrix, InvertsLowerTriangles) {
  std::mt19937 random(2);
  for (Eigen::Index k = 1; k <= 13; ++k) {
    // Above the diagonal is what must not be read.
    MatrixXd L = 0.3 * MatrixXd(DrawPadded(k, k, &random).leftCols(k));
    L.diagonal().array() += 3.0;
    MatrixXd L_inv = MatrixXd::Constant(k, k, 7.0);
    InvertLowerTriangle(L, &L_inv);
    const MatrixXd product = L.triangularView<Eigen::Lower>() * L_inv;
    EXPECT_TRUE(MatrixNear(product, MatrixXd::Identity(k, k), kRounding));
  }
}

}  // namespace
}  // namespace dexcheck::testing
