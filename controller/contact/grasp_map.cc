#include "controller/contact/grasp_map.h"

#include "controller/common/errors.h"
#include "controller/object/so3.h"

namespace dexcheck {

GroundContacts::GroundContacts(const RobotModel& model, std::span<const int> feet, double height)
    : feet_(feet.begin(), feet.end()), height_(height), X_WF_(feet.size(), Pose::Identity()) {
  for (const int foot : feet_) radii_.push_back(model.frame(foot).sphere_radius.value_or(0.0));
  const auto m = static_cast<Eigen::Index>(feet_.size());
  J_.setZero(3 * m, model.num_velocities());
  J_dot_xi_.setZero(3 * m);
  gap_.setZero(m);
  J_f_.setZero(6, model.num_velocities());
  J_f_dot_ = J_f_;
}

void GroundContacts::SetState(const ModelTerms& robot) {
  const VectorXd& xi = robot.velocity();
  for (size_t i = 0; i < feet_.size(); ++i) {
    const auto row = 3 * static_cast<Eigen::Index>(i);
    X_WF_[i] = robot.CalcFramePose(feet_[i]);
    const Matrix3d R = X_WF_[i].linear();
    robot.CalcFrameJacobian(feet_[i], J_f_, J_f_dot_);
    const double gap = X_WF_[i].translation().z() - radii_[i] - height_;
    gap_[static_cast<Eigen::Index>(i)] = gap;
    // v_F + omega x a, both of which J_f has along the frame's own axes
    const Vector3d n = R.transpose() * Vector3d::UnitZ();
    const Vector3d a = -(radii_[i] + 0.5 * gap) * n;
    J_.middleRows<3>(row).noalias() = R * (J_f_.topRows<3>() - Skew(a) * J_f_.bottomRows<3>());
    // a_F = R (v_dot + omega x v) of the velocity v along axes that turn
    const Vector6d V = J_f_ * xi;
    const Vector6d V_dot = J_f_dot_ * xi;
    const Vector3d v = V.head<3>(), omega = V.tail<3>();
    const Vector3d a_dot = -0.5 * n.dot(v) * n;
    J_dot_xi_.segment<3>(row) =
        R * (V_dot.head<3>() + omega.cross(v) + V_dot.tail<3>().cross(a) + omega.cross(a_dot));
  }
}

namespace {

void RequireGraspShape(std::span<const Contact> contacts, Eigen::Index columns) {
  Require(!contacts.empty(), "number of contacts", "must be positive", 0.0);
  Require(columns == 3 * static_cast<Eigen::Index>(contacts.size()), "columns of the grasp map",
          "must equal the number of contact forces", columns);
}

using Matrix36 = Eigen::Matrix<double, 3, 6>;

void RequireRowsShape(Eigen::Index columns, Eigen::Ref<MatrixXd> rows) {
  Require(rows.rows() == 3, "rows of the contact Jacobian", "must be three", rows.rows());
  Require(rows.cols() == columns, "columns of the contact Jacobian",
          "must equal those of the fingertip Jacobian", rows.cols());
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

void CalcContactJacobian(const Contact& contact, const Eigen::Ref<const Matrix6Xd>& J_f,
                         Eigen::Ref<MatrixXd> rows) {
  RequireRowsShape(J_f.cols(), rows);
  // B_c^T Ad_{g_cf_f} J_f
  const Matrix36 A = CalcAdjointInverse(contact.geometry.g_f_cf).topRows<3>();
  auto J = rows.topRows<3>();
  for (Eigen::Index i = 0; i < J_f.cols(); ++i) J.col(i).noalias() = A * J_f.col(i);
}

void CalcContactJacobianDot(const Contact& contact, const Eigen::Ref<const Matrix6Xd>& J_f,
                            const Eigen::Ref<const Matrix6Xd>& J_f_dot, Eigen::Ref<MatrixXd> rows_dot) {
  RequireRowsShape(J_f.cols(), rows_dot);
  Require(J_f_dot.cols() == J_f.cols(), "columns of J_f_dot", "must equal those of J_f", J_f_dot.cols());
  // d/dt (Ad_{g_cf_f} J_f) = Ad_{g_cf_f} J_f_dot - ad_V Ad_{g_cf_f} J_f with V = V_f_cf^cf
  const Matrix6d Ad = CalcAdjointInverse(contact.geometry.g_f_cf);
  const Matrix6d Ad_dot =
      -CalcTwistCross(CalcFrameTwistOnFingertip(contact.geometry, contact.kappa_dot)) * Ad;
  const Matrix36 A = Ad.topRows<3>();
  const Matrix36 A_dot = Ad_dot.topRows<3>();
  auto J_dot = rows_dot.topRows<3>();
  for (Eigen::Index i = 0; i < J_f.cols(); ++i)
    J_dot.col(i).noalias() = A * J_f_dot.col(i) + A_dot * J_f.col(i);
}

}  // namespace dexcheck
