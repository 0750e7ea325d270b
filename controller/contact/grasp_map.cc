#include "controller/contact/grasp_map.h"

#include "controller/common/errors.h"
#include "controller/contact/adjoint.h"

namespace dexcheck {
namespace {

void RequireGraspShape(std::span<const Contact> contacts, Eigen::Index columns) {
  Require(!contacts.empty(), "number of contacts", "must be positive", 0.0);
  Require(columns == 3 * static_cast<Eigen::Index>(contacts.size()), "columns of the grasp map",
          "must equal the number of contact forces", columns);
}

}  // namespace

void CalcGraspMap(std::span<const Contact> contacts, Eigen::Ref<Matrix6Xd> G) {
  RequireGraspShape(contacts, G.cols());
  Eigen::Index column = 0;
  for (const Contact& contact : contacts) {
    // G_i = Ad_{g_o_cf}^-T B_c
    G.middleCols<3>(column) = CalcWrenchTransform(contact.geometry.g_o_cf).leftCols<3>();
    column += 3;
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
    G_dot.middleCols<3>(column) = rate.leftCols<3>();
    column += 3;
  }
}

}  // namespace dexcheck
