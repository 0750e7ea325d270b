#include "controller/contact/contact_jacobian.h"

#include <stdexcept>
#include <type_traits>

#include "controller/common/errors.h"
#include "controller/contact/adjoint.h"

namespace dexcheck {
namespace {

/// B_c^T A, kForces x 6.
template <int kForces>
Eigen::Matrix<double, kForces, 6> SelectTransmittedRows(ContactType type, const Matrix6d& A) {
  Eigen::Matrix<double, kForces, 6> selected;
  Eigen::Index index = 0;
  for (const int row : ListTransmittedRows(type)) selected.row(index++) = A.row(row);
  return selected;
}

/// Calls calc(m) with the contact type's number of forces m as a constant, so that products have fixed sizes.
template <typename Calc>
void WithForceCount(ContactType type, const Calc& calc) {
  switch (CountForces(type)) {
    case 1:
      return calc(std::integral_constant<int, 1>());
    case 3:
      return calc(std::integral_constant<int, 3>());
    case 4:
      return calc(std::integral_constant<int, 4>());
    default:
      throw std::logic_error("contact type: no such number of forces");
  }
}

void RequireRowsShape(const Contact& contact, Eigen::Index columns, Eigen::Ref<MatrixXd> rows) {
  Require(rows.rows() == CountForces(contact.type), "rows of the contact Jacobian",
          "must equal the contact's force count", static_cast<double>(rows.rows()));
  Require(rows.cols() == columns, "columns of the contact Jacobian",
          "must equal those of the fingertip Jacobian", static_cast<double>(rows.cols()));
}

/// Calls visit(columns) for each run of columns, or for all columns at once when there are none.
template <typename Visit>
void ForEachRun(std::span<const ColumnRun> columns, Eigen::Index all, const Visit& visit) {
  if (columns.empty()) return visit(ColumnRun{0, all});
  for (const ColumnRun& run : columns) visit(run);
}

}  // namespace

void CalcContactJacobian(const Contact& contact, const Eigen::Ref<const Matrix6Xd>& J_f,
                         Eigen::Ref<MatrixXd> rows, std::span<const ColumnRun> columns) {
  RequireRowsShape(contact, J_f.cols(), rows);
  // B_c^T Ad_{g_cf_f} J_f
  WithForceCount(contact.type, [&](auto m) {
    const Eigen::Matrix<double, m(), 6> A =
        SelectTransmittedRows<m()>(contact.type, CalcAdjointInverse(contact.geometry.g_f_cf));
    auto J = rows.topRows<m()>();
    ForEachRun(columns, J_f.cols(), [&](const ColumnRun& run) {
      for (Eigen::Index i = run.begin; i < run.begin + run.count; ++i) J.col(i).noalias() = A * J_f.col(i);
    });
  });
}

void CalcContactJacobianDot(const Contact& contact, const Eigen::Ref<const Matrix6Xd>& J_f,
                            const Eigen::Ref<const Matrix6Xd>& J_f_dot, Eigen::Ref<MatrixXd> rows_dot,
                            std::span<const ColumnRun> columns) {
  RequireRowsShape(contact, J_f.cols(), rows_dot);
  Require(J_f_dot.cols() == J_f.cols(), "columns of J_f_dot", "must equal those of J_f",
          static_cast<double>(J_f_dot.cols()));
  // d/dt (Ad_{g_cf_f} J_f) = Ad_{g_cf_f} J_f_dot - ad_V Ad_{g_cf_f} J_f with V = V_f_cf^cf
  const Matrix6d Ad = CalcAdjointInverse(contact.geometry.g_f_cf);
  const Matrix6d Ad_dot =
      -CalcTwistCross(CalcFrameTwistOnFingertip(contact.geometry, contact.kappa_dot)) * Ad;
  WithForceCount(contact.type, [&](auto m) {
    const Eigen::Matrix<double, m(), 6> A = SelectTransmittedRows<m()>(contact.type, Ad);
    const Eigen::Matrix<double, m(), 6> A_dot = SelectTransmittedRows<m()>(contact.type, Ad_dot);
    auto J_dot = rows_dot.topRows<m()>();
    ForEachRun(columns, J_f.cols(), [&](const ColumnRun& run) {
      for (Eigen::Index i = run.begin; i < run.begin + run.count; ++i)
        J_dot.col(i).noalias() = A * J_f_dot.col(i) + A_dot * J_f.col(i);
    });
  });
}

void CalcHandJacobian(std::span<const Contact> contacts, std::span<const Matrix6Xd> J_f,
                      Eigen::Ref<MatrixXd> J_h) {
  Require(!contacts.empty(), "number of contacts", "must be positive", 0.0);
  Require(J_f.size() == contacts.size(), "number of fingertip Jacobians", "must equal the number of contacts",
          static_cast<double>(J_f.size()));
  Eigen::Index joints = 0;
  for (const Matrix6Xd& J : J_f) joints += J.cols();
  Require(J_h.rows() == CountForces(contacts), "rows of J_h", "must equal the number of contact forces",
          static_cast<double>(J_h.rows()));
  Require(J_h.cols() == joints, "columns of J_h", "must equal the number of finger joints",
          static_cast<double>(J_h.cols()));
  J_h.setZero();
  Eigen::Index row = 0;
  Eigen::Index column = 0;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const int forces = CountForces(contacts[i].type);
    CalcContactJacobian(contacts[i], J_f[i], J_h.block(row, column, forces, J_f[i].cols()));
    row += forces;
    column += J_f[i].cols();
  }
}

}  // namespace dexcheck
