#include "harness/checks/baseline_reference.h"

#include "controller/common/errors.h"
#include "controller/common/linear_algebra.h"
#include "controller/object/so3.h"

namespace dexcheck {

BaselineReference::BaselineReference(ControlLaw law, const ObjectStiffness& stiffness, int num_velocities,
                                     int num_forces)
    : law_(law), stiffness_(stiffness), M_llt_(num_velocities), Lambda_c_llt_(num_forces) {
  Require(law != ControlLaw::kComputedTorque, "law", "must be one of the baselines",
          static_cast<double>(law));
  M_inv_J_T_.setZero(num_velocities, num_forces);
  G_Lambda_c_.setZero(6, num_forces);
  for (MatrixXd* matrix : {&Lambda_c_inv_, &Lambda_c_}) matrix->setZero(num_forces, num_forces);
  for (VectorXd* vector : {&force_, &motion_, &xi_e_}) vector->setZero(num_velocities);
  for (VectorXd* vector : {&f_c_, &rates_}) vector->setZero(num_forces);
}

bool BaselineReference::CalcInertia(const LawTerms& terms) {
  // Lambda_c = (J M^-1 J^T)^-1, Lambda = M_hat + G Lambda_c G^T
  M_llt_.compute(*terms.M);
  if (M_llt_.info() != Eigen::Success) return false;
  M_inv_J_T_ = terms.J.transpose();
  M_llt_.solveInPlace(M_inv_J_T_);
  Lambda_c_inv_.noalias() = terms.J * M_inv_J_T_;
  Lambda_c_llt_.compute(Lambda_c_inv_);
  if (Lambda_c_llt_.info() != Eigen::Success) return false;
  Lambda_c_.setIdentity();
  Lambda_c_llt_.solveInPlace(Lambda_c_);
  G_Lambda_c_.noalias() = terms.G * Lambda_c_;
  Lambda_ = terms.M_hat;
  Lambda_.noalias() += G_Lambda_c_ * terms.G.transpose();
  return true;
}

void BaselineReference::CalcErrors(const LawSpec& spec, const LawTerms& terms, const DesiredMotion& desired) {
  const Matrix3d R_T = terms.X_Bo.linear().transpose();
  const Vector3d omega = terms.V_Bo.tail<3>();
  const Vector3d v_d = R_T * desired.X_d_dot.head<3>();
  e_.head<3>() = R_T * (desired.X_d.head<3>() - terms.X_Bo.translation());
  V_e_.head<3>() = v_d - terms.V_Bo.head<3>();
  V_d_dot_.head<3>() = R_T * desired.X_d_ddot.head<3>() - omega.cross(v_d);
  if (spec.orientation == OrientationFeedback::kAngles) {
    const Vector3d angles = terms.X_o.tail<3>();
    const Matrix3d B = CalcAngleMap(angles);
    const Vector3d rates = B.inverse() * omega;
    e_.tail<3>() = B * (desired.X_d.tail<3>() - angles);
    V_e_.tail<3>() = B * desired.X_d_dot.tail<3>() - omega;
    V_d_dot_.tail<3>() =
        B * desired.X_d_ddot.tail<3>() + CalcAngleMapRate(angles, rates) * desired.X_d_dot.tail<3>();
    return;
  }
  const DesiredPose pose = CalcDesiredPose(desired);
  const Matrix3d R_od = R_T * pose.R_Bd;
  const Vector3d omega_d = R_od * pose.omega_d;
  e_.tail<3>() = LogSo3(R_od);
  V_e_.tail<3>() = omega_d - omega;
  V_d_dot_.tail<3>() = R_od * pose.omega_d_dot - omega.cross(omega_d);
}

Vector6d BaselineReference::CalcWrench(const LawSpec& spec, const LawTerms& terms) const {
  const Matrix3d R = terms.X_Bo.linear();
  const auto turn = [&](const Vector6d& k) {
    Matrix6d K = k.asDiagonal();
    K.topLeftCorner<3, 3>() = R.transpose() * K.topLeftCorner<3, 3>() * R;
    return K;
  };
  const Matrix6d K = turn(stiffness_.K);
  const Vector6d stiff = turn(stiffness_.K.cwiseProduct(spec.position_factor)) * e_;
  if (law_ != ControlLaw::kImpedance)
    return stiff + turn(stiffness_.D.cwiseProduct(spec.velocity_factor)) * V_e_;
  // K v = k Lambda v with v^T Lambda v = 1: Q = Lambda [v1 .. v6]
  Vector6d k;
  Matrix6d V;
  DecomposeGeneralized(K, Lambda_, &k, &V);
  const Matrix6d Q = Lambda_ * V;
  const Vector6d roots = k.cwiseMax(0.0).cwiseSqrt();
  return stiff + spec.velocity_factor[0] * 2.0 * stiffness_.damping_ratio *
                     (Q * roots.cwiseProduct(Q.transpose() * V_e_));
}

bool BaselineReference::Evaluate(const LawSpec& spec, const LawReference& plain, const LawTerms& terms,
                                 const Matrix6Xd& G_dot, const DesiredMotion& desired,
                                 const Eigen::Ref<const VectorXd>& F_N) {
  if (!CalcInertia(terms)) return false;
  Vector6d V_dot = plain.V_Bo_dot();
  Vector6d F_o = terms.N_o;
  force_ = terms.gravity;
  if (law_ == ControlLaw::kOperationalSpace) {
    // J^T Lambda_c (G^T V_dot + G_dot^T V - J_dot xi - J sigma') + M sigma' + C xi + F
    rates_ = terms.G_dot_T_V - terms.J_dot_xi;
    rates_.noalias() += terms.G.transpose() * V_dot;
    rates_.noalias() -= terms.J * plain.sigma_prime();
    f_c_.noalias() = Lambda_c_ * rates_;
    force_ += terms.C_xi + terms.friction;
    force_.noalias() += terms.J.transpose() * f_c_;
    force_.noalias() += *terms.M * plain.sigma_prime();
    F_o += terms.M_hat * V_dot + terms.C_hat_V;
  } else {
    CalcErrors(spec, terms, desired);
    V_dot = Lambda_.llt().solve(CalcWrench(spec, terms));
    rates_.setZero();
    if (law_ != ControlLaw::kPdGravity) {
      V_dot += V_d_dot_;
      // Terms of V_d and xi_d by those of V_o and xi: xi_d - xi = J^+ (G^T V_d - J xi)
      rates_.noalias() = terms.G.transpose() * (terms.V_Bo + V_e_);
      rates_.noalias() -= terms.J * terms.xi;
      plain.ApplyPseudoinverse(&rates_, &xi_e_);
      rates_ = terms.G_dot_T_V - terms.J_dot_xi;
      rates_.noalias() += G_dot.transpose() * V_e_;
      rates_.noalias() -= *terms.J_dot * xi_e_;
      force_ += terms.friction + terms.C_xi;
      force_.noalias() += *terms.C * xi_e_;
      // C_hat = diag(m [omega]x, -[I_o omega]x)
      const Vector6d momentum = terms.M_hat * terms.V_Bo;
      F_o += terms.C_hat_V;
      F_o.head<3>() += terms.M_hat(0, 0) * terms.V_Bo.tail<3>().cross(V_e_.head<3>());
      F_o.tail<3>() -= momentum.tail<3>().cross(V_e_.tail<3>());
    }
    rates_.noalias() += terms.G.transpose() * V_dot;
    // J^+ rates + sigma' - J^+ J sigma'
    rates_.noalias() -= terms.J * plain.sigma_prime();
    plain.ApplyPseudoinverse(&rates_, &motion_);
    motion_ += plain.sigma_prime();
    force_.noalias() += *terms.M * motion_;
    F_o += terms.M_hat * V_dot;
  }
  f_c_ = F_N;
  plain.AddLeastForces(F_o, &f_c_);
  force_.noalias() += terms.J.transpose() * f_c_;
  return true;
}

}  // namespace dexcheck
