#include "controller/grasp/grasp_rank.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <limits>

#include "controller/common/errors.h"

namespace dexcheck::grasp_internal {
namespace {

// FindWeakestDirection with the last three rows divided by `arm`.
WeakestDirection FindWeakest(const Eigen::Ref<const Matrix6Xd>& G, double arm) {
  WeakestDirection weakest;
  if (!G.allFinite()) {
    weakest.ratio = std::numeric_limits<double>::quiet_NaN();
    return weakest;
  }
  Vector6d factor = Vector6d::Ones();
  factor.tail<3>() /= arm;
  const double size = G.size() == 0 ? 0.0 : (factor.asDiagonal() * G).cwiseAbs().maxCoeff();
  if (size == 0.0) return weakest;
  factor /= size;

  // G^T = Q R, three columns of G at a time; R^T has the left singular vectors and the singular values of G.
  constexpr Eigen::Index kBlock = 3;
  Eigen::Matrix<double, 6 + kBlock, 6> stack = Eigen::Matrix<double, 6 + kBlock, 6>::Zero();
  for (Eigen::Index column = 0; column < G.cols(); column += kBlock) {
    stack.bottomRows<kBlock>().setZero();
    const Eigen::Index count = std::min(kBlock, G.cols() - column);
    stack.middleRows(6, count).noalias() = G.middleCols(column, count).transpose() * factor.asDiagonal();
    const Eigen::HouseholderQR<Eigen::Matrix<double, 6 + kBlock, 6>> qr(stack);
    stack.topRows<6>() = qr.matrixQR().topRows<6>().triangularView<Eigen::Upper>();
  }
  const Eigen::JacobiSVD<Matrix6d> svd(stack.topRows<6>().transpose(), Eigen::ComputeFullU);
  weakest.ratio = svd.singularValues()[5] / svd.singularValues()[0];
  weakest.n = svd.matrixU().col(5);
  return weakest;
}

}  // namespace

WeakestDirection FindWeakestDirection(const Eigen::Ref<const Matrix6Xd>& G) { return FindWeakest(G, 1.0); }

void RequireFullRank(const Eigen::Ref<const Matrix6Xd>& G) {
  const double arm = G.size() == 0 ? 0.0 : G.bottomRows<3>().colwise().norm().maxCoeff();
  const double ratio = FindWeakest(G, arm > 0.0 ? arm : 1.0).ratio;
  if (ratio > kRankTolerance) return;
  throw SingularityError(
      "G: must have full row rank, got the ratio of singular values " + FormatNumber(ratio), ratio);
}

}  // namespace dexcheck::grasp_internal
