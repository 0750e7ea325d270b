#include "harness/checks/law_reference.h"

#include <cmath>

#include "controller/object/so3.h"

namespace dexcheck {
Matrix3d CalcAngleMap(const Vector3d& angles) {
  const double sb = std::sin(angles[1]), cb = std::cos(angles[1]);
  const double sg = std::sin(angles[2]), cg = std::cos(angles[2]);
  Matrix3d B;
  B << -sb * cg, sg, 0.0, sb * sg, cg, 0.0, cb, 0.0, 1.0;
  return B;
}

Matrix3d CalcAngleMapRate(const Vector3d& angles, const Vector3d& rates) {
  const double sb = std::sin(angles[1]), cb = std::cos(angles[1]);
  const double sg = std::sin(angles[2]), cg = std::cos(angles[2]);
  const double b = rates[1], g = rates[2];
  Matrix3d B_dot;
  B_dot << -cb * cg * b + sb * sg * g, cg * g, 0.0, cb * sg * b + sb * cg * g, -sg * g, 0.0, -sb * b, 0.0,
      0.0;
  return B_dot;
}

LawSpec MakeLawSpec(const GraspControllerOptions& options) {
  return {options.gains, options.orientation, options.weight, options.posture};
}

LawTerms::LawTerms(int num_positions, int num_velocities, int num_forces) {
  q.setZero(num_positions);
  xi.setZero(num_velocities);
  C_xi.setZero(num_velocities);
  gravity.setZero(num_velocities);
  friction.setZero(num_velocities);
  J.setZero(num_forces, num_velocities);
  J_dot_xi.setZero(num_forces);
  G.setZero(6, num_forces);
  G_dot_T_V.setZero(num_forces);
}

LawReference::LawReference(int num_velocities, int num_forces) : llt_(num_forces), W_llt_(num_velocities) {
  for (MatrixXd* matrix : {&A_, &L_inv_}) matrix->setZero(num_forces, num_forces);
  for (VectorXd* vector : {&rates_, &slip_rates_, &f_c_}) vector->setZero(num_forces);
  for (VectorXd* vector :
       {&slip_coriolis_, &slip_acceleration_, &xi_c_, &xi_dot_d_, &motion_, &sigma_prime_, &force_})
    vector->setZero(num_velocities);
  W_inv_J_T_.setZero(num_velocities, num_forces);
  G_.setZero(6, num_forces);
}

bool LawReference::FactorJacobian(const LawSpec& spec, const LawTerms& terms) {
  // J^+ = W^-1 J^T (J W^-1 J^T)^-1
  W_inv_J_T_ = terms.J.transpose();
  if (spec.weight.kind == RedundancyWeight::Kind::kDiagonal) {
    W_inv_J_T_.array().colwise() /= spec.weight.w.array();
  } else if (spec.weight.kind == RedundancyWeight::Kind::kMass) {
    W_llt_.compute(*terms.M);
    W_llt_.solveInPlace(W_inv_J_T_);
  }
  A_.noalias() = terms.J * W_inv_J_T_;
  llt_.compute(A_);
  if (llt_.info() != Eigen::Success) return false;
  L_inv_.setIdentity();
  llt_.matrixL().solveInPlace(L_inv_);
  condition_number_ = std::sqrt(A_.trace()) * L_inv_.norm();
  G_ = terms.G;
  G_llt_.compute(G_ * G_.transpose());
  return G_llt_.info() == Eigen::Success && std::isfinite(condition_number_);
}

void LawReference::ApplyPseudoinverse(VectorXd* y, VectorXd* x) const {
  llt_.solveInPlace(*y);
  x->noalias() = W_inv_J_T_ * *y;
}

void LawReference::AddLeastForces(const Vector6d& F_o, VectorXd* f_c) const {
  f_c->noalias() += G_.transpose() * G_llt_.solve(F_o);
}

Vector6d LawReference::SolveGrasp(const Eigen::Ref<const VectorXd>& f) const { return G_llt_.solve(G_ * f); }

LawReference::Demand LawReference::CalcObjectAcceleration(const LawSpec& spec, const LawObject& object,
                                                          const DesiredMotion& desired) {
  const Matrix3d R_T = object.X_Bo.linear().transpose();
  const Vector3d v = object.V_Bo.head<3>();
  const Vector3d omega = object.V_Bo.tail<3>();
  Demand demand;
  auto& [feed_forward, velocity, position, rate] = demand;

  // v = R^T p_dot, hence v_dot = R^T p_ddot - omega x v
  const Vector3d p_dot = R_T.transpose() * v;
  const auto K_v = spec.gains.K_v.array() * spec.velocity_factor.array();
  const auto K_p = spec.gains.K_p.array() * spec.position_factor.array();
  feed_forward.head<3>() = R_T * desired.X_d_ddot.head<3>();
  velocity.head<3>() = R_T * (K_v.head<3>() * (desired.X_d_dot.head<3>() - p_dot).array()).matrix();
  position.head<3>() =
      R_T * (K_p.head<3>() * (desired.X_d.head<3>() - object.X_Bo.translation()).array()).matrix();
  rate.head<3>() = -omega.cross(v);

  if (spec.orientation == OrientationFeedback::kAngles) {
    // omega = B a_dot, hence omega_dot = B a_ddot + B_dot a_dot
    const Vector3d angles = object.X_o.tail<3>();
    const Matrix3d B = CalcAngleMap(angles);
    const Vector3d angle_rates = B.inverse() * omega;
    feed_forward.tail<3>() = B * desired.X_d_ddot.tail<3>();
    velocity.tail<3>() = B * (K_v.tail<3>() * (desired.X_d_dot.tail<3>() - angle_rates).array()).matrix();
    position.tail<3>() = B * (K_p.tail<3>() * (desired.X_d.tail<3>() - angles).array()).matrix();
    rate.tail<3>() = CalcAngleMapRate(angles, angle_rates) * angle_rates;
  } else {
    // e_R = log(R_Bo^T R_Bd) obeys (57). omega_dot is affine in e_R_ddot: its parts by that of each summand.
    const DesiredPose pose = CalcDesiredPose(desired);
    const OrientationError error = CalcOrientationError(object.X_Bo.linear(), omega, pose.R_Bd, pose.omega_d);
    const auto accelerate = [&](const Vector3d& omega_d_dot, const Vector3d& e_R_ddot) {
      return CalcAngularAcceleration(error, pose.omega_d, omega_d_dot, e_R_ddot);
    };
    const Vector3d zero = Vector3d::Zero();
    const Vector3d bias = accelerate(zero, zero);
    rate.tail<3>() = bias;
    feed_forward.tail<3>() = accelerate(pose.omega_d_dot, zero) - bias;
    velocity.tail<3>() = accelerate(zero, -(K_v.tail<3>() * error.e_R_dot.array()).matrix()) - bias;
    position.tail<3>() = accelerate(zero, -(K_p.tail<3>() * error.e_R.array()).matrix()) - bias;
  }
  return demand;
}

Vector6d LawReference::CalcDemand(const LawSpec& spec, const LawObject& object,
                                  const DesiredMotion& desired) {
  const Demand demand = CalcObjectAcceleration(spec, object, desired);
  return demand[0] + demand[1] + demand[2] + spec.rate_factor * demand[3];
}

bool LawReference::Evaluate(const LawSpec& spec, const LawTerms& terms, const DesiredMotion& desired,
                            const Eigen::Ref<const VectorXd>& F_N) {
  if (!FactorJacobian(spec, terms)) return false;
  V_Bo_dot_ = CalcDemand(spec, {terms.X_Bo, terms.V_Bo, terms.X_o}, desired);

  // xi_c = xi - J^+ (J xi - G^T V_o)
  rates_.noalias() = -terms.J * terms.xi;
  rates_.noalias() += terms.G.transpose() * terms.V_Bo;
  ApplyPseudoinverse(&rates_, &xi_c_);  // less xi
  slip_rates_.noalias() = *terms.J_dot * xi_c_;
  rates_ = slip_rates_;
  ApplyPseudoinverse(&rates_, &slip_acceleration_);
  slip_coriolis_.noalias() = *terms.C * xi_c_;

  // sigma' = acceleration + damping (xi_reference - xi) + stiffness [0; q_posture - q]
  const PostureTask& posture = spec.posture;
  const Eigen::Index joints = posture.q_posture.size();
  sigma_prime_ = posture.acceleration + posture.damping.cwiseProduct(posture.xi_reference - terms.xi);
  sigma_prime_.tail(joints) += posture.stiffness.cwiseProduct(posture.q_posture - terms.q.tail(joints));

  // xi_dot_d = J^+ (G^T V_o_dot + G_dot^T V_o - J_dot xi_c) + N sigma', N = 1 - J^+ J
  rates_ = terms.G_dot_T_V - terms.J_dot_xi - slip_rates_;
  rates_.noalias() += terms.G.transpose() * V_Bo_dot_;
  if (spec.projects) rates_.noalias() -= terms.J * sigma_prime_;
  ApplyPseudoinverse(&rates_, &xi_dot_d_);
  xi_dot_d_ += sigma_prime_;

  // f_c = G^+ F_o + F_N, F_o = M_hat V_o_dot + C_hat V_o + N_o
  f_c_ = F_N;
  const Vector6d F_o = terms.M_hat * V_Bo_dot_ + terms.C_hat_V + terms.N_o;
  if (spec.transposes_grasp) {
    f_c_.noalias() += G_.transpose() * F_o;
  } else {
    AddLeastForces(F_o, &f_c_);
  }

  force_ = terms.C_xi + slip_coriolis_ + terms.gravity + terms.friction;
  force_.noalias() += *terms.M * xi_dot_d_;
  force_.noalias() += terms.J.transpose() * f_c_;
  return true;
}

}  // namespace dexcheck
