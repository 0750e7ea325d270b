#pragma once

// Decompositions that many need: each is compiled once, here. Those of matrices of any size allocate, and are
// for what is not done at every step of control.

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <numeric>
#include <span>
#include <vector>

#include "controller/common/types.h"

namespace dexcheck {

/// 0, 1, ... count - 1.
template <typename Count>
std::vector<int> ListIndices(Count count) {
  std::vector<int> indices(static_cast<size_t>(count));
  std::iota(indices.begin(), indices.end(), 0);
  return indices;
}

/// Eigenvalues, ascending, and their orthonormal eigenvectors as columns.
struct SymmetricEigen {
  VectorXd values;
  MatrixXd vectors;
};

/// Decomposes a symmetric matrix, whose lower triangle is read.
SymmetricEigen DecomposeSymmetric(const Eigen::Ref<const MatrixXd>& S);

/// The eigenvalues alone, ascending.
VectorXd CalcSymmetricEigenvalues(const Eigen::Ref<const MatrixXd>& S);

/// Decomposes a symmetric 6 x 6 matrix without allocating: eigenvalues ascending, eigenvectors as columns.
void DecomposeSymmetric(const Matrix6d& S, Vector6d* values, Matrix6d* vectors);

/// K v = k Lambda v with v^T Lambda v = 1: k ascending and the v as columns, of K symmetric and Lambda
/// symmetric and positive definite. Allocates nothing.
void DecomposeGeneralized(const Matrix6d& K, const Matrix6d& Lambda, Vector6d* values, Matrix6d* vectors);

/// Factors a symmetric matrix J W^-1 J^T of constraints, whose lower triangle is read. Allocates nothing
/// where the sizes fit.
/// @throws SingularityError "PROBLEM, smallest independent part ..." when a pivot is below 1e-8 of its
/// diagonal entry: a constraint of which less is independent of the others loses half of its digits or more.
void FactorIndependent(const Eigen::Ref<const MatrixXd>& A, const char* problem, Eigen::LLT<MatrixXd>* llt);

/// A matrix of any shape and rank, decomposed for several right-hand sides.
class LeastSquares {
 public:
  /// @param independent a pivot below this fraction of the largest counts as zero; 0 stands for what rounding
  /// explains.
  explicit LeastSquares(double independent = 0.0);

  LeastSquares& Compute(const Eigen::Ref<const MatrixXd>& A);

  [[nodiscard]] Eigen::Index rank() const { return decomposition_.rank(); }
  /// The x of least norm among those that make |A x - b| least.
  [[nodiscard]] VectorXd Solve(const Eigen::Ref<const VectorXd>& b) const;
  /// The x of least norm among those that make |A^T x - b| least.
  [[nodiscard]] VectorXd SolveTransposed(const Eigen::Ref<const VectorXd>& b) const;

 private:
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> decomposition_;
};

/// The x of least norm among those that make |A x - b| least, for A of any shape and rank.
/// @param independent a pivot below this fraction of the largest counts as zero; 0 stands for what rounding
/// explains.
VectorXd SolveLeastSquares(const Eigen::Ref<const MatrixXd>& A, const Eigen::Ref<const VectorXd>& b,
                           double independent = 0.0);

/// A^+ of Moore and Penrose, for A of any shape and rank.
MatrixXd CalcPseudoinverse(const Eigen::Ref<const MatrixXd>& A);

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

/// Lower triangle of A = H^T H over the rows listed, as above.
inline void CalcGramMatrix(const RowMatrixXd& H, std::span<const int> rows, MatrixXd* A) {
  CalcGramMatrix(H, H, rows, A);
}

}  // namespace dexcheck
