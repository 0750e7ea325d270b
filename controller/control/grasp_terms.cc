#include "controller/control/grasp_terms.h"

#include <algorithm>
#include <set>
#include <stdexcept>

#include "controller/common/errors.h"
#include "controller/contact/contact_geometry.h"
#include "controller/object/so3.h"

namespace dexcheck {

namespace {

/// J xi of a J (kRows x n), column by column: most may be zero.
template <int kRows, typename Matrix>
Eigen::Matrix<double, kRows, 1> MultiplyColumns(const Matrix& J, const VectorXd& xi) {
  Eigen::Matrix<double, kRows, 1> product = Eigen::Matrix<double, kRows, 1>::Zero();
  for (Eigen::Index i = 0; i < J.cols(); ++i) product += xi[i] * J.col(i);
  return product;
}

}  // namespace

GraspTerms::GraspTerms(const RobotModel& model, std::span<const int> fingertips, const MassProperties& object,
                       const Surface& surface)
    : fingertips_(fingertips.begin(), fingertips.end()),
      object_(object),
      gravity_(model.gravity()),
      surface_(&surface) {
  for (const int frame : fingertips_) tips_.emplace_back(model.tip_radius(frame));
  const int n = model.num_velocities();
  const int k = num_forces();
  contacts_.resize(fingertips_.size());
  overlaps_.assign(fingertips_.size(), 0.0);
  G_.setZero(6, k);
  G_dot_.setZero(6, k);
  J_B_.setZero(k, n);
  J_B_dot_.setZero(k, n);
  tip_jacobians_.assign(fingertips_.size(), {Matrix6Xd::Zero(6, n), Matrix6Xd::Zero(6, n)});
  slip_.setZero(k);
  slip_bias_.setZero(k);
  std::set<int> moving;
  for (const int frame : fingertips_) {
    for (const int i : model.ListMovingEntries(model.frame(frame).link)) moving.insert(i);
  }
  moving_entries_.assign(moving.begin(), moving.end());
}

void GraspTerms::SetOverlaps(std::span<const double> overlaps) {
  Require(overlaps.size() == overlaps_.size(), "number of overlaps", "must be that of the fingertips",
          overlaps.size());
  std::copy(overlaps.begin(), overlaps.end(), overlaps_.begin());
}

void GraspTerms::SetBonds(std::span<const Bond> bonds) {
  Require(bonds.size() == fingertips_.size(), "number of bonds", "must be that of the fingertips",
          bonds.size());
  bonds_.assign(bonds.begin(), bonds.end());
}

void GraspTerms::SetBond(const Pose& X_Bf, const Vector6d& V_f, size_t finger) {
  const Bond& bond = bonds_[finger];
  Contact& contact = contacts_[finger];
  contact.kappa_dot.setZero();
  contact.geometry.g_o_cf = bond.g_o_cf;
  const Matrix3d R_f_cf = X_Bf.linear().transpose() * X_Bo_.linear() * bond.g_o_cf.linear();
  contact.geometry.g_f_cf.linear() = R_f_cf;
  contact.geometry.g_f_cf.translation() = bond.p_f;

  // Rows R_cf_f (v + omega x p_f) of V_f = [v; omega]; Sigma_cf turns with the object: R_dot_cf_f = R_cf_f
  // [omega_f - omega_o]x, all in f.
  const Vector3d turn = V_f.tail<3>() - X_Bf.linear().transpose() * X_Bo_.linear() * V_Bo_.tail<3>();
  const Matrix3d R_cf_f = R_f_cf.transpose();
  const Matrix3d R_dot = R_cf_f * Skew(turn);
  const Matrix3d S = Skew(bond.p_f);
  const Eigen::Index row = 3 * static_cast<Eigen::Index>(finger);
  auto J = J_B_.middleRows<3>(row);
  auto J_dot = J_B_dot_.middleRows<3>(row);
  const auto& [J_f, J_f_dot] = tip_jacobians_[finger];
  J.noalias() = R_cf_f * J_f.topRows<3>();
  J.noalias() -= (R_cf_f * S) * J_f.bottomRows<3>();
  J_dot.noalias() = R_dot * J_f.topRows<3>();
  J_dot.noalias() -= (R_dot * S) * J_f.bottomRows<3>();
  J_dot.noalias() += R_cf_f * J_f_dot.topRows<3>();
  J_dot.noalias() -= (R_cf_f * S) * J_f_dot.bottomRows<3>();
}

void GraspTerms::SetState(const ModelTerms& robot, const Vector6d& X_o, const Vector6d& X_o_dot,
                          std::span<const ContactCoordinates> kappa) {
  has_coordinates_ = true;
  X_o_ = X_o;
  X_o_dot_ = X_o_dot;
  coordinates_ = CalcObjectTerms(object_, gravity_, X_o, X_o_dot);
  X_Bo_ = CalcObjectPose(X_o);
  V_Bo_ = coordinates_.V_Bo;
  body_ = coordinates_.body;
  SetContacts(robot, kappa);
}

void GraspTerms::SetPose(const ModelTerms& robot, const Pose& X_Bo, const Vector6d& V_Bo,
                         std::span<const ContactCoordinates> kappa) {
  has_coordinates_ = false;
  X_Bo_ = X_Bo;
  V_Bo_ = V_Bo;
  body_ = CalcObjectBodyTerms(object_, gravity_, X_Bo.linear(), V_Bo);
  SetContacts(robot, kappa);
}

void GraspTerms::SetContacts(const ModelTerms& robot, std::span<const ContactCoordinates> kappa) {
  Require(kappa.size() == fingertips_.size(), "number of kappa", "must be that of the fingertips",
          kappa.size());
  Require(robot.size() == J_B_.cols(), "entries of xi", "must be those of the grasp's model", robot.size());
  for (size_t i = 0; i < fingertips_.size(); ++i) {
    const Eigen::Index row = 3 * static_cast<Eigen::Index>(i);
    Contact& contact = contacts_[i];
    auto& [J_f, J_f_dot] = tip_jacobians_[i];
    robot.CalcFrameColumns(fingertips_[i], J_f, J_f_dot);
    const Vector6d V_f = MultiplyColumns<6>(J_f, robot.velocity());
    contact.geometry = CalcContactGeometry(tips_[i], *surface_, kappa[i], overlaps_[i]);
    if (!bonds_.empty()) {
      SetBond(robot.CalcFramePose(fingertips_[i]), V_f, i);
      continue;
    }
    contact.kappa_dot = CalcKappaDot(contact.geometry, CalcRelativeTwist(contact.geometry, V_f, V_Bo_));
    CalcContactJacobian(contact, J_f, J_B_.middleRows(row, 3));
    CalcContactJacobianDot(contact, J_f, J_f_dot, J_B_dot_.middleRows(row, 3));
  }
  if (fingertips_.empty()) return;  // nothing is held
  CalcGraspMap(contacts_, G_);
  CalcGraspMapDot(contacts_, G_dot_);
  for (size_t i = 0; i < fingertips_.size(); ++i) CalcSlip(robot.velocity(), i);
}

void GraspTerms::CalcSlip(const VectorXd& xi, size_t finger) {
  // (45), (46)
  const Eigen::Index row = 3 * static_cast<Eigen::Index>(finger);
  slip_.segment<3>(row) = MultiplyColumns<3>(J_B_.middleRows<3>(row), xi);
  slip_.segment<3>(row) -= G_.middleCols<3>(row).transpose() * V_Bo_;
  slip_bias_.segment<3>(row) = MultiplyColumns<3>(J_B_dot_.middleRows<3>(row), xi);
  slip_bias_.segment<3>(row) -= G_dot_.middleCols<3>(row).transpose() * V_Bo_;
}

void GraspTerms::RequireCoordinates() const {
  if (!has_coordinates_) throw std::logic_error("X_o: the grasp's state was set by a pose");
}

const Vector6d& GraspTerms::X_o() const {
  RequireCoordinates();
  return X_o_;
}

const Vector6d& GraspTerms::X_o_dot() const {
  RequireCoordinates();
  return X_o_dot_;
}

const ObjectTerms& GraspTerms::coordinates() const {
  RequireCoordinates();
  return coordinates_;
}

GraspModel::GraspModel(const RobotModel& model, std::span<const int> fingertips, const MassProperties& object,
                       const Surface& surface, const GraspModelOptions& options)
    : orientation_(options.orientation),
      robot_(model, Coordinates::kReduced),
      grasp_(model, fingertips, object, surface),
      X_o_(options.X_o_start) {
  if (!options.bonds.empty()) grasp_.SetBonds(options.bonds);
}

void GraspModel::SetState(const MeasuredState& state) {
  robot_.SetState(state.q, state.xi);
  robot_.CalcDynamics();
  grasp_.SetOverlaps(state.overlap);
  if (has_coordinates()) {
    X_o_ = CalcObjectCoordinates(state.X_Bo, X_o_);
    grasp_.SetState(robot_, X_o_, CalcP(X_o_) * state.V_Bo, state.kappa);
  } else {
    grasp_.SetPose(robot_, state.X_Bo, state.V_Bo, state.kappa);
  }
}

Vector6d CalcTrackingAcceleration(const ObjectGains& gains, const GraspTerms& grasp,
                                  const DesiredMotion& desired) {
  // X_o_ddot = X_d_ddot + K_v E_dot + K_p E
  const Vector6d E = desired.X_d - grasp.X_o();
  const Vector6d E_dot = desired.X_d_dot - grasp.X_o_dot();
  const Vector6d X_o_ddot = desired.X_d_ddot + gains.K_v.cwiseProduct(E_dot) + gains.K_p.cwiseProduct(E);
  return grasp.coordinates().P_inv * X_o_ddot + grasp.coordinates().P_inv_dot * grasp.X_o_dot();
}

Vector6d CalcTrackingAcceleration(const ObjectGains& gains, const Pose& X_Bo, const Vector6d& V_Bo,
                                  const DesiredPose& desired) {
  const Matrix3d R_Bo = X_Bo.linear();
  const Vector3d v = V_Bo.head<3>();
  const Vector3d omega = V_Bo.tail<3>();
  // p_ddot = p_d_ddot + K_v E_dot + K_p E with p_dot = R v, hence v_dot = R^T p_ddot - omega x v
  const Vector3d E = desired.p_Bd - X_Bo.translation();
  const Vector3d E_dot = desired.p_Bd_dot - R_Bo * v;
  const Vector3d p_ddot =
      desired.p_Bd_ddot + gains.K_v.head<3>().cwiseProduct(E_dot) + gains.K_p.head<3>().cwiseProduct(E);
  // e_R_ddot = -K_v e_R_dot - K_p e_R
  const OrientationError error = CalcOrientationError(R_Bo, omega, desired.R_Bd, desired.omega_d);
  const Vector3d e_R_ddot =
      -gains.K_v.tail<3>().cwiseProduct(error.e_R_dot) - gains.K_p.tail<3>().cwiseProduct(error.e_R);
  Vector6d V_Bo_dot;
  V_Bo_dot << R_Bo.transpose() * p_ddot - omega.cross(v),
      CalcAngularAcceleration(error, desired.omega_d, desired.omega_d_dot, e_R_ddot);
  return V_Bo_dot;
}

Vector6d CalcTrackingAcceleration(const ObjectGains& gains, OrientationFeedback feedback,
                                  const GraspTerms& grasp, const DesiredMotion& desired) {
  if (feedback == OrientationFeedback::kAngles) return CalcTrackingAcceleration(gains, grasp, desired);
  return CalcTrackingAcceleration(gains, grasp.X_Bo(), grasp.V_Bo(), CalcDesiredPose(desired));
}

ObjectErrors CalcObjectErrors(OrientationFeedback feedback, const GraspTerms& grasp,
                              const DesiredMotion& desired) {
  ObjectErrors errors;
  if (feedback == OrientationFeedback::kAngles) {
    const ObjectTerms& terms = grasp.coordinates();
    errors.e = terms.P_inv * (desired.X_d - grasp.X_o());
    errors.V_error = terms.P_inv * (desired.X_d_dot - grasp.X_o_dot());
    errors.V_d_dot = terms.P_inv * desired.X_d_ddot + terms.P_inv_dot * desired.X_d_dot;
    return errors;
  }
  const DesiredPose pose = CalcDesiredPose(desired);
  const Matrix3d R_oB = grasp.X_Bo().linear().transpose();
  const Vector3d omega = grasp.V_Bo().tail<3>();
  const OrientationError error = CalcOrientationError(grasp.X_Bo().linear(), omega, pose.R_Bd, pose.omega_d);
  const Vector3d v_d = R_oB * pose.p_Bd_dot;
  const Vector3d omega_d = error.R_od * pose.omega_d;
  errors.e << R_oB * (pose.p_Bd - grasp.X_Bo().translation()), error.e_R;
  errors.V_error << v_d - grasp.V_Bo().head<3>(), error.omega_od;
  // d/dt (R_oB x) = R_oB x_dot - omega x (R_oB x), d/dt (R_od x) = R_od (x_dot + omega_d x x) - omega x (R_od
  // x)
  errors.V_d_dot << R_oB * pose.p_Bd_ddot - omega.cross(v_d),
      error.R_od * pose.omega_d_dot - omega.cross(omega_d);
  return errors;
}

}  // namespace dexcheck
