#pragma once

// Gram matrices of the narrow matrices that contacts bring, J W^-1 J^T and its kin: k x k, of n rows.

#include <span>

#include "controller/common/types.h"

namespace dexcheck {

/// The width of H in CalcGramMatrix is a multiple of this.
inline constexpr Eigen::Index kGramBlock = 4;

/// k, padded to a width for CalcGramMatrix.
constexpr Eigen::Index PadToGramBlock(Eigen::Index k) {
  return (k + kGramBlock - 1) / kGramBlock * kGramBlock;
}

/// Lower triangle of A = sum_i h_i^T h_i of those rows h_i of H that `rows` lists. Above the diagonal A may
/// have anything.
///
/// A block of A stays in registers while all rows pass by: for 12 columns a third of the time that one row
/// after the other takes.
/// @param H n x PadToGramBlock(k), zeros in the padding. @param A of that width both ways.
inline void CalcGramMatrix(const RowMatrixXd& H, std::span<const int> rows, MatrixXd* A) {
  using Block = Eigen::Matrix<double, kGramBlock, kGramBlock>;
  using BlockVector = Eigen::Matrix<double, kGramBlock, 1>;
  for (Eigen::Index col = 0; col < A->cols(); col += kGramBlock) {
    for (Eigen::Index row = col; row < A->rows(); row += kGramBlock) {
      Block sum = Block::Zero();
      for (const int i : rows) {
        const double* const h = H.data() + i * H.outerStride();
        const Eigen::Map<const BlockVector> h_row(h + row), h_col(h + col);
        for (Eigen::Index k = 0; k < kGramBlock; ++k) sum.col(k) += h_col[k] * h_row;
      }
      A->block<kGramBlock, kGramBlock>(row, col) = sum;
    }
  }
}

}  // namespace dexcheck
