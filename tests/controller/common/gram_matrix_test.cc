#include "controller/common/gram_matrix.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>
#include <vector>

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

}  // namespace
}  // namespace dexcheck::testing::gram_matrix_test
