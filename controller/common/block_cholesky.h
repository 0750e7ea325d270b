#pragma once

// Cholesky factor A = L L^T of the small matrices that contacts bring, k x k of k = 3N. In blocks of four by
// four, which stay in registers: a general factorisation spends most of its time on loops that are too short.

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

}  // namespace dexcheck
