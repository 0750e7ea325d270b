#include "harness/diagnosis/visible_columns.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <limits>
#include <utility>

#include "controller/common/linear_algebra.h"

namespace dexcheck {

using Eigen::Index;

namespace {

/// @param noise of the sum over all rows. @param independent as of VisibleColumns.
Visible FindVisible(const Candidate& candidate, double noise, double independent) {
  const MatrixXd& C = candidate.columns;
  const VectorXd scale = candidate.scale.size() > 0 ? candidate.scale : VectorXd(VectorXd::Ones(C.cols()));
  const bool is_bounded = candidate.scale.size() > 0;
  if (C.cols() == 1) {
    const double size = C.norm();
    if (!(size > 0.0) || (is_bounded && size * scale[0] < noise)) return {};
    return {C, MatrixXd::Identity(1, 1), VectorXd::Ones(1)};
  }
  // The visible ones are those of C diag(scale) = U S V^T with S above the noise.
  const VectorXd size = C.colwise().norm().transpose();
  const VectorXd unit =
      is_bounded ? scale : VectorXd(size.unaryExpr([](double s) { return s > 0.0 ? 1.0 / s : 0.0; }));
  // Singular values of R, C diag(unit) = Q R, have all their digits; those of C^T C only half of them.
  const Eigen::HouseholderQR<MatrixXd> qr(C * unit.asDiagonal());
  const MatrixXd R = qr.matrixQR().topRows(std::min(C.rows(), C.cols())).triangularView<Eigen::Upper>();
  const Eigen::JacobiSVD<MatrixXd> svd(R, Eigen::ComputeFullV);
  const VectorXd& values = svd.singularValues();
  constexpr double kMostIndependent = 1e-7;
  const double least =
      std::max(is_bounded ? noise : 0.0, std::min(independent, kMostIndependent) * values[0]);
  Index visible = 0;
  while (visible < values.size() && values[visible] > least) ++visible;
  Visible result;
  result.basis = unit.asDiagonal() * svd.matrixV().leftCols(visible);
  result.columns = C * result.basis;
  result.unit = unit;
  return result;
}

}  // namespace

VectorXd CalcErrors(const Visible& visible, const MatrixXd& covariance) {
  const MatrixXd& B = visible.basis;
  VectorXd error = (B * covariance * B.transpose()).diagonal().cwiseMax(0.0).cwiseSqrt();
  if (B.rows() == B.cols()) return error;
  // The fraction of each amplitude, squared, that is a combination of those.
  const VectorXd unit = visible.unit.cwiseMax(std::numeric_limits<double>::min());
  const VectorXd known = (unit.cwiseInverse().asDiagonal() * B).rowwise().squaredNorm();
  constexpr double kKnown = 0.99;
  return (known.array() < kKnown).select(std::numeric_limits<double>::infinity(), error);
}

VisibleColumns::VisibleColumns(std::span<const Candidate> candidates, const VectorXd& y, double noise,
                               double independent)
    : y_(y), independent_(independent), begins_{0} {
  for (const Candidate& one : candidates) {
    visible_.push_back(FindVisible(one, noise, independent));
    begins_.push_back(begins_.back() + visible_.back().columns.cols());
  }
  all_.resize(y.size(), begins_.back());
  for (size_t i = 0; i < visible_.size(); ++i) {
    if (CountOf(i) > 0) all_.middleCols(begins_[i], CountOf(i)) = std::exchange(visible_[i].columns, {});
  }
  sizes_ = all_.colwise().norm();
  with_y_ = all_.transpose() * y;
  for (size_t i = 0; i < visible_.size(); ++i) {
    const VectorXd by = sizes_.segment(begins_[i], CountOf(i)).cwiseInverse();
    grams_.emplace_back(by.asDiagonal() * (Of(i).transpose() * Of(i)) * by.asDiagonal());
  }
}

MatrixXd VisibleColumns::Collect(const std::vector<size_t>& set) const {
  Index width = 0;
  for (const size_t i : set) width += CountOf(i);
  MatrixXd C(all_.rows(), width);
  width = 0;
  for (const size_t i : set) {
    C.middleCols(width, CountOf(i)) = Of(i);
    width += CountOf(i);
  }
  return C;
}

const MatrixXd& VisibleColumns::Project(const MatrixXd& Q) const {
  Index same = 0;
  while (same < std::min(Q.cols(), last_Q_.cols()) && Q.col(same) == last_Q_.col(same)) ++same;
  projected_.conservativeResize(all_.cols(), Q.cols());
  if (same < Q.cols())
    projected_.rightCols(Q.cols() - same).noalias() = all_.transpose() * Q.rightCols(Q.cols() - same);
  last_Q_ = Q;
  return projected_;
}

VectorXd VisibleColumns::CalcLeft(const MatrixXd& Q, const VectorXd& r, double floor) const {
  // r^T r - g^T H^-1 g, g = S^-1 (C^T y - C^T Q Q^T y) and H = S^-1 (C^T C - C^T Q Q^T C) S^-1 of a
  // candidate's columns C and their sizes S; where that cancels, from the columns.
  constexpr double kCancelled = 1e-14, kExact = 1e-8;
  const MatrixXd& projected = Project(Q);
  const VectorXd g = (with_y_ - projected * (Q.transpose() * y_)).cwiseQuotient(sizes_);
  const double square = r.squaredNorm(), size = y_.norm();
  VectorXd left = VectorXd::Constant(static_cast<Index>(visible_.size()), square);
  for (size_t i = 0; i < visible_.size(); ++i) {
    const Index begin = begins_[i], width = CountOf(i);
    if (width == 0) continue;
    const MatrixXd scaled =
        sizes_.segment(begin, width).cwiseInverse().asDiagonal() * projected.middleRows(begin, width);
    const Eigen::LLT<MatrixXd> cholesky(grams_[i] - scaled * scaled.transpose());
    double& one = left[static_cast<Index>(i)];
    const MatrixXd& L = cholesky.matrixLLT();
    const double least = cholesky.info() == Eigen::Success ? L.diagonal().minCoeff() : 0.0;
    one -= cholesky.matrixL().solve(g.segment(begin, width)).squaredNorm();
    const double error = kCancelled * size * r.norm() / (least * least);
    if (!(error <= kExact * (floor + std::max(0.0, one)))) one = CalcExactly(i, Q, r);
  }
  return left;
}

double VisibleColumns::CalcExactly(size_t candidate, const MatrixXd& Q, VectorXd r) const {
  const Index begin = begins_[candidate];
  MatrixXd own = Of(candidate);
  own.noalias() -= Q * projected_.middleRows(begin, own.cols()).transpose();
  for (Index k = 0; k < own.cols(); ++k) {
    const double size = own.col(k).norm();
    if (!(size > independent_ * sizes_[begin + k])) continue;
    own.col(k) /= size;
    // The residual is subtracted, since squares that nearly cancel have no digits left.
    r -= own.col(k).dot(r) * own.col(k);
    for (Index j = k + 1; j < own.cols(); ++j) own.col(j) -= own.col(k).dot(own.col(j)) * own.col(k);
  }
  return r.squaredNorm();
}

}  // namespace dexcheck
