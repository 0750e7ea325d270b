#include "controller/control/grasp_terms.h"

#include <algorithm>
#include <stdexcept>

#include "controller/common/errors.h"
#include "controller/contact/contact_geometry.h"
#include "controller/object/euler_zyz.h"

namespace dexcheck {
namespace {

/// J xi of a J (kRows x n) that has other columns than these zero.
template <int kRows, typename Matrix>
Eigen::Matrix<double, kRows, 1> MultiplyColumns(const Matrix& J, std::span<const ColumnRun> columns,
                                                const VectorXd& xi) {
  Eigen::Matrix<double, kRows, 1> product = Eigen::Matrix<double, kRows, 1>::Zero();
  for (const ColumnRun& run : columns) {
    for (Eigen::Index i = run.begin; i < run.begin + run.count; ++i) product += xi[i] * J.col(i);
  }
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
  ListChains(model);
}

void GraspTerms::ListChains(const RobotModel& model) {
  std::vector<bool> moves_any(static_cast<size_t>(model.num_velocities()), false);
  for (const int frame : fingertips_) {
    std::vector<ColumnRun>& runs = chains_.emplace_back();
    for (const int i : model.ListMovingEntries(model.frame(frame).link)) {
      moves_any[static_cast<size_t>(i)] = true;
      if (runs.empty() || runs.back().begin + runs.back().count != i) runs.push_back({i, 0});
      ++runs.back().count;
    }
  }
  for (int i = 0; i < model.num_velocities(); ++i) {
    if (moves_any[static_cast<size_t>(i)]) moving_entries_.push_back(i);
  }
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
    const Vector6d V_f = MultiplyColumns<6>(J_f, chains_[i], robot.velocity());
    contact.geometry = CalcContactGeometry(tips_[i], *surface_, kappa[i], overlaps_[i]);
    if (!bonds_.empty()) {
      SetBond(robot.CalcFramePose(fingertips_[i]), V_f, i);
      continue;
    }
    contact.kappa_dot = CalcKappaDot(contact.geometry, CalcRelativeTwist(contact.geometry, V_f, V_Bo_));
    CalcContactJacobian(contact, J_f, J_B_.middleRows(row, 3), chains_[i]);
    CalcContactJacobianDot(contact, J_f, J_f_dot, J_B_dot_.middleRows(row, 3), chains_[i]);
  }
  if (fingertips_.empty()) return;  // nothing is held
  CalcGraspMap(contacts_, G_);
  CalcGraspMapDot(contacts_, G_dot_);
  for (size_t i = 0; i < fingertips_.size(); ++i) CalcSlip(robot.velocity(), i);
}

void GraspTerms::CalcSlip(const VectorXd& xi, size_t finger) {
  // (45), (46)
  const Eigen::Index row = 3 * static_cast<Eigen::Index>(finger);
  const auto& chain = chains_[finger];
  slip_.segment<3>(row) = MultiplyColumns<3>(J_B_.middleRows<3>(row), chain, xi);
  slip_.segment<3>(row) -= G_.middleCols<3>(row).transpose() * V_Bo_;
  slip_bias_.segment<3>(row) = MultiplyColumns<3>(J_B_dot_.middleRows<3>(row), chain, xi);
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

}  // namespace dexcheck
