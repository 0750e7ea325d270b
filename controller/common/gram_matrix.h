#pragma once

// Gram matrices of the narrow matrices that contacts bring, J W^-1 J^T and its kin: k x k, of n rows.

#include <span>

#include "controller/common/types.h"

namespace dexcheck {

/// Widths in CalcGramMatrix are multiples of this.
inline constexpr Eigen::Index kGramBlock = 4;

/// k, padded to such a width.
constexpr Eigen::Index PadToGramBlock(Eigen::Index k) {
  return (k + kGramBlock - 1) / kGramBlock * kGramBlock;
}

/// Lower triangle of A = sum_i h_i^T w_i over those rows of H and W_H that `rows` lists, symmetric since W_H
/// is a symmetric matrix times H. Above the diagonal A may have anything.
///
/// A block of A stays in registers while all rows pass by: for 12 columns that takes a third of the time that
/// one row after the other takes.
/// @param H, W_H n x PadToGramBlock(k), zeros in the padding. @param A of that width both ways.
inline void CalcGramMatrix(const RowMatrixXd& H, const RowMatrixXd& W_H, std::span<const int> rows,
                           MatrixXd* A) {
  using Block = Eigen::Matrix<double, kGramBlock, kGramBlock>;
  using BlockVector = Eigen::Matrix<double, kGramBlock, 1>;
  for (Eigen::Index col = 0; col < A->cols(); col += kGramBlock) {
    for (Eigen::Index row = col; row < A->rows(); row += kGramBlock) {
      Block sum = Block::Zero();
      for (const int i : rows) {
        const Eigen::Map<const BlockVector> h(H.data() + i * H.cols() + row);
        const double* const w = W_H.data() + i * W_H.cols() + col;
        for (Eigen::Index k = 0; k < kGramBlock; ++k) sum.col(k) += w[k] * h;
      }
      A->block<kGramBlock, kGramBlock>(row, col) = sum;
    }
  }
}

/// Lower triangle of A = H^T H over the rows listed, as above.
inline void CalcGramMatrix(const RowMatrixXd& H, std::span<const int> rows, MatrixXd* A) {
  CalcGramMatrix(H, H, rows, A);
}

}  // namespace dexcheck
