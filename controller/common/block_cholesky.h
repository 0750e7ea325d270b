#pragma once

// Cholesky factor A = L L^T of the small matrices that contacts bring, k x k of k = 3N. In blocks of four by
// four, which stay in registers: a general factorisation spends most of its time on loops that are too short.

#include <span>
#include <vector>

#include "controller/common/types.h"

namespace dexcheck {

/// Workspace for the factor of one matrix at a time. Nothing allocates after construction.
class BlockCholesky {
 public:
  static constexpr Eigen::Index kBlock = 4;

  /// @param size k.
  explicit BlockCholesky(Eigen::Index size);

  /// @param A k x k, or with rows and columns added; its lower triangle is read.
  /// @returns false when A is not positive definite.
  [[nodiscard]] bool Factor(const Eigen::Ref<const MatrixXd>& A);

  /// x (k) becomes A^-1 x.
  void Solve(Eigen::Ref<VectorXd> x);
  /// Diagonal entry of L.
  [[nodiscard]] double pivot(Eigen::Index i) const {
    return at(i / kBlock, i / kBlock)(i % kBlock, i % kBlock);
  }
  /// |L^-1|, the root of the sum of its entries' squares: |L^-1|^2 = trace(A^-1).
  [[nodiscard]] double CalcInverseNorm();

 private:
  using Block = Eigen::Matrix<double, kBlock, kBlock>;
  using BlockVector = Eigen::Matrix<double, kBlock, 1>;
  /// Of the lower triangle of blocks, row >= col.
  [[nodiscard]] static size_t Index(Eigen::Index row, Eigen::Index col) {
    return static_cast<size_t>(row * (row + 1) / 2 + col);
  }
  [[nodiscard]] const Block& at(Eigen::Index row, Eigen::Index col) const { return L_[Index(row, col)]; }

  Eigen::Index size_;
  Eigen::Index blocks_;              // rows of blocks; behind size_ A is the identity
  std::vector<Block> L_;             // lower triangle of blocks
  std::vector<Block> L_inv_;         // of L^-1; its diagonal blocks by Factor
  std::vector<BlockVector> vector_;  // k
};

// Gram matrices of the narrow matrices that contacts bring, J W^-1 J^T and its kin: k x k, of n rows.

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

/// The same of H^T H.
inline void CalcGramMatrix(const RowMatrixXd& H, std::span<const int> rows, MatrixXd* A) {
  CalcGramMatrix(H, H, rows, A);
}

}  // namespace dexcheck
