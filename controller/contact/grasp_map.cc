#include "controller/contact/grasp_map.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "controller/common/errors.h"
#include "controller/contact/adjoint.h"

namespace dexcheck {
namespace {

// Ratio of the extreme singular values of G below which it counts as rank deficient.
constexpr double kMinSingularValueRatio = 1e-6;

void RequireGraspShape(std::span<const Contact> contacts, Eigen::Index columns) {
  Require(!contacts.empty(), "number of contacts", "must be positive", 0.0);
  Require(columns == CountForces(contacts), "columns of the grasp map",
          "must equal the number of contact forces", static_cast<double>(columns));
}

// Columns of `wrenches` (6x6) that the contact type transmits, i.e. wrenches * B_c, to G from `column` on.
void WriteTransmittedColumns(const Matrix6d& wrenches, ContactType type, Eigen::Index& column,
                             Eigen::Ref<Matrix6Xd> G) {
  for (const int row : ListTransmittedRows(type)) G.col(column++) = wrenches.col(row);
}

}  // namespace

int CountForces(std::span<const Contact> contacts) {
  int count = 0;
  for (const Contact& contact : contacts) count += CountForces(contact.type);
  return count;
}

void CalcGraspMap(std::span<const Contact> contacts, Eigen::Ref<Matrix6Xd> G) {
  RequireGraspShape(contacts, G.cols());
  Eigen::Index column = 0;
  for (const Contact& contact : contacts) {
    // G_i = Ad_{g_o_cf}^-T B_c
    WriteTransmittedColumns(CalcWrenchTransform(contact.geometry.g_o_cf), contact.type, column, G);
  }
}

void CalcGraspMapDot(std::span<const Contact> contacts, Eigen::Ref<Matrix6Xd> G_dot) {
  RequireGraspShape(contacts, G_dot.cols());
  Eigen::Index column = 0;
  for (const Contact& contact : contacts) {
    // d/dt Ad_{g_o_cf}^-1 = -ad_V Ad_{g_o_cf}^-1 with V = V_o_cf^cf, hence
    // G_i_dot = -(Ad_{g_o_cf}^-T ad_V^T) B_c
    const Vector6d V = CalcFrameTwistOnObject(contact.geometry, contact.kappa_dot);
    const Matrix6d rate = -CalcWrenchTransform(contact.geometry.g_o_cf) * CalcTwistCross(V).transpose();
    WriteTransmittedColumns(rate, contact.type, column, G_dot);
  }
}

void RequireFullGrasp(const Eigen::Ref<const Matrix6Xd>& G) {
  Require(G.cols() >= 6, "number of contact forces", "must be at least 6 for a full grasp",
          static_cast<double>(G.cols()));
  const double arm = G.bottomRows<3>().colwise().norm().maxCoeff();
  Matrix6d gram = G.lazyProduct(G.transpose());
  if (arm > 0.0) {
    gram.bottomRows<3>() /= arm;
    gram.rightCols<3>() /= arm;
  }
  const Vector6d squares =
      Eigen::SelfAdjointEigenSolver<Matrix6d>(gram, Eigen::EigenvaluesOnly).eigenvalues();
  const double ratio = std::sqrt(std::max(squares(0), 0.0) / squares(5));
  if (ratio > kMinSingularValueRatio) return;
  throw SingularityError(
      "grasp map has less than rank 6, ratio of its extreme singular values: " + FormatNumber(ratio), ratio);
}

}  // namespace dexcheck
