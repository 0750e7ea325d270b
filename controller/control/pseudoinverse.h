#pragma once

// Weighted right pseudoinverse of a wide matrix (47), applied through a Cholesky factor and never formed:
//   J^+ = W^-1 J^T (J W^-1 J^T)^-1,   N = 1 - J^+ J,   J (k x n), k <= n, W (n x n) symmetric positive
//   definite.
// Among all x with J x = y, J^+ y has the least x^T W x. Nothing allocates after construction, except the
// functions that return matrices.

#include <Eigen/Cholesky>
#include <span>
#include <string>
#include <vector>

#include "controller/common/linear_algebra.h"
#include "controller/common/types.h"

namespace dexcheck {

/// Workspace for the pseudoinverse of one matrix at a time.
class Pseudoinverse {
 public:
  /// Largest condition number of J W^-1/2 that is accepted. J W^-1 J^T has the square of it, so that four
  /// digits are left.
  static constexpr double kMaxConditionNumber = 1e6;

  /// @param name of the matrix, for messages. @param rows k. @param columns n.
  /// @throws std::invalid_argument unless 0 < k <= n.
  Pseudoinverse(std::string name, Eigen::Index rows, Eigen::Index columns);

  /// Factors J (k x n) with W = 1.
  /// @param columns those that can differ from zero, ascending: no other is looked at. All when empty.
  /// @throws std::invalid_argument when the shape differs, SingularityError with the condition number when J
  /// has not full row rank, as far as double precision can distinguish.
  void Factor(const Eigen::Ref<const MatrixXd>& J, std::span<const int> columns = {});
  /// Factors J with the weight W = diag(w). @throws std::invalid_argument also unless every entry of w (n) is
  /// positive.
  void FactorDiagonal(const Eigen::Ref<const MatrixXd>& J, const Eigen::Ref<const VectorXd>& w,
                      std::span<const int> columns = {});
  /// Factors J with any weight W (n x n), whose lower triangle is read.
  /// @throws std::invalid_argument also when W is not positive definite.
  void FactorWeighted(const Eigen::Ref<const MatrixXd>& J, const Eigen::Ref<const MatrixXd>& W);

  /// Bound on the condition number of J W^-1/2: not below it, and at most k times as large.
  [[nodiscard]] double condition_number() const { return condition_number_; }

  /// x (n) = J^+ y (k).
  void Apply(const Eigen::Ref<const VectorXd>& y, Eigen::Ref<VectorXd> x);
  /// x (n) becomes N x.
  void Project(Eigen::Ref<VectorXd> x);

  /// J^+ (n x k). Allocates.
  [[nodiscard]] MatrixXd CalcMatrix() const;
  /// N (n x n). Allocates.
  [[nodiscard]] MatrixXd CalcProjector() const;

 private:
  void Load(const Eigen::Ref<const MatrixXd>& J, std::span<const int> columns);
  void SetEntries(const std::vector<int>& entries);
  void FactorGram();

  std::string name_;
  std::vector<int> all_columns_;
  std::vector<int> columns_;     // of J that can differ from zero
  std::vector<int> entries_;     // of W^-1 J^T y that can
  RowMatrixXd J_T_, W_inv_J_T_;  // n x k, padded for CalcGramMatrix; zero but in columns_ and entries_
  MatrixXd W_solution_;          // n x k, of any W
  MatrixXd gram_;                // k x k, padded: J W^-1 J^T, lower triangle
  VectorXd work_;                // k
  Eigen::LLT<MatrixXd> gram_llt_, W_llt_;
  MatrixXd L_inv_;  // k x k, of J W^-1 J^T = L L^T
  double condition_number_ = 0.0;
};

}  // namespace dexcheck
