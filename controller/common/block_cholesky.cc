#include "controller/common/block_cholesky.h"

#include <algorithm>
#include <cmath>

namespace dexcheck {
namespace {

using Matrix4d = Eigen::Matrix4d;

/// S = L L^T of a block, lower triangle. Above its diagonal L has zeros.
bool FactorBlock(const Matrix4d& S, Matrix4d* L) {
  *L = S.triangularView<Eigen::Lower>();
  for (int col = 0; col < 4; ++col) {
    const double pivot = (*L)(col, col);
    if (!(pivot > 0.0)) return false;
    const double root = std::sqrt(pivot);
    (*L)(col, col) = root;
    for (int row = col + 1; row < 4; ++row) (*L)(row, col) /= root;
    for (int next = col + 1; next < 4; ++next) {
      for (int row = next; row < 4; ++row) (*L)(row, next) -= (*L)(row, col) * (*L)(next, col);
    }
  }
  return true;
}

/// S becomes S L^-T, column by column: products with L^-1 would lose more digits.
void SolveOnTheRight(const Matrix4d& L, Matrix4d* S) {
  for (int col = 0; col < 4; ++col) {
    for (int k = 0; k < col; ++k) S->col(col) -= L(col, k) * S->col(k);
    S->col(col) /= L(col, col);
  }
}

/// x becomes L^-1 x.
void SolveLower(const Matrix4d& L, Eigen::Vector4d* x) {
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < i; ++k) (*x)[i] -= L(i, k) * (*x)[k];
    (*x)[i] /= L(i, i);
  }
}

/// x becomes L^-T x.
void SolveUpper(const Matrix4d& L, Eigen::Vector4d* x) {
  for (int i = 3; i >= 0; --i) {
    for (int k = i + 1; k < 4; ++k) (*x)[i] -= L(k, i) * (*x)[k];
    (*x)[i] /= L(i, i);
  }
}

Matrix4d InvertLower(const Matrix4d& L) {
  Matrix4d inverse = Matrix4d::Zero();
  for (int col = 0; col < 4; ++col) {
    inverse(col, col) = 1.0 / L(col, col);
    for (int row = col + 1; row < 4; ++row) {
      double sum = 0.0;
      for (int k = col; k < row; ++k) sum += L(row, k) * inverse(k, col);
      inverse(row, col) = -sum / L(row, row);
    }
  }
  return inverse;
}

}  // namespace

BlockCholesky::BlockCholesky(Eigen::Index size)
    : size_(size),
      blocks_((size + kBlock - 1) / kBlock),
      L_(Index(blocks_, 0), Block::Identity()),
      L_inv_(L_),
      vector_(static_cast<size_t>(blocks_), BlockVector::Zero()) {}

bool BlockCholesky::Factor(const Eigen::Ref<const MatrixXd>& A) {
  for (Eigen::Index row = 0; row < blocks_; ++row) {
    const Eigen::Index height = std::min(kBlock, size_ - kBlock * row);
    for (Eigen::Index col = 0; col <= row; ++col) {
      // L_row,col L_col,col^T = A_row,col - sum_k L_row,k L_col,k^T
      Block S = row == col ? Block(Block::Identity()) : Block(Block::Zero());
      const Eigen::Index width = std::min(kBlock, size_ - kBlock * col);
      if (height == kBlock && width == kBlock) {
        S = A.block<kBlock, kBlock>(kBlock * row, kBlock * col);
      } else {
        S.topLeftCorner(height, width) = A.block(kBlock * row, kBlock * col, height, width);
      }
      for (Eigen::Index k = 0; k < col; ++k) S.noalias() -= at(row, k) * at(col, k).transpose();
      if (row == col) {
        if (!FactorBlock(S, &L_[Index(row, row)])) return false;
        L_inv_[Index(row, row)] = InvertLower(at(row, row));
      } else {
        SolveOnTheRight(at(col, col), &S);
        L_[Index(row, col)] = S;
      }
    }
  }
  return true;
}

void BlockCholesky::Solve(Eigen::Ref<VectorXd> x) {
  for (Eigen::Index row = 0; row < blocks_; ++row) {
    BlockVector sum = BlockVector::Zero();
    const Eigen::Index height = std::min(kBlock, size_ - kBlock * row);
    sum.head(height) = x.segment(kBlock * row, height);
    for (Eigen::Index k = 0; k < row; ++k) sum.noalias() -= at(row, k) * vector_[static_cast<size_t>(k)];
    SolveLower(at(row, row), &sum);
    vector_[static_cast<size_t>(row)] = sum;
  }
  for (Eigen::Index row = blocks_ - 1; row >= 0; --row) {
    BlockVector sum = vector_[static_cast<size_t>(row)];
    for (Eigen::Index k = row + 1; k < blocks_; ++k)
      sum.noalias() -= at(k, row).transpose() * vector_[static_cast<size_t>(k)];
    SolveUpper(at(row, row), &sum);
    vector_[static_cast<size_t>(row)] = sum;
    const Eigen::Index height = std::min(kBlock, size_ - kBlock * row);
    x.segment(kBlock * row, height) = vector_[static_cast<size_t>(row)].head(height);
  }
}

double BlockCholesky::CalcInverseNorm() {
  double squares = 0.0;
  for (Eigen::Index row = 0; row < blocks_; ++row) {
    const Eigen::Index height = std::min(kBlock, size_ - kBlock * row);
    squares += L_inv_[Index(row, row)].topRows(height).squaredNorm();
    for (Eigen::Index col = 0; col < row; ++col) {
      // L_inv_row,col = -L_inv_row,row sum_k L_row,k L_inv_k,col
      Block sum = Block::Zero();
      for (Eigen::Index k = col; k < row; ++k) sum.noalias() += at(row, k) * L_inv_[Index(k, col)];
      L_inv_[Index(row, col)].noalias() = -L_inv_[Index(row, row)] * sum;
      squares += L_inv_[Index(row, col)].topRows(height).squaredNorm();
    }
  }
  return std::sqrt(squares);
}

}  // namespace dexcheck
