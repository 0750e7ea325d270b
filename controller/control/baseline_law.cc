#include "controller/control/baseline_law.h"

#include <array>
#include <cmath>

#include "controller/common/errors.h"
#include "controller/common/linear_algebra.h"

namespace dexcheck {

ObjectSpaceInertia::ObjectSpaceInertia(const RobotModel& model, int num_contacts) : factor_(model) {
  Require(num_contacts > 0, "number of contacts", "must be positive", num_contacts);
  const Eigen::Index k = Eigen::Index{3} * num_contacts;
  half_.setZero(model.num_velocities(), PadToGramBlock(k));
  inverse_.setZero(half_.cols(), half_.cols());
  inverse_llt_ = Eigen::LLT<MatrixXd>(k);
  G_T_.setZero(k, 6);
}

void ObjectSpaceInertia::Compute(const ModelTerms& robot, const GraspTerms& grasp) {
  Require(robot.size() == half_.rows(), "entries of xi", "must be as constructed", robot.size());
  const Eigen::Index k = G_T_.rows();
  Require(grasp.num_forces() == k, "number of contact forces", "must be as constructed", grasp.num_forces());
  // M = L^T L; Lambda_c^-1 = (L^-T J^T)^T (L^-T J^T)
  factor_.Compute(robot.M());
  for (const int i : grasp.moving_entries()) half_.row(i).head(k) = grasp.J_B().col(i).transpose();
  factor_.SolveTransposedColumns(grasp.moving_entries(), half_);
  CalcGramMatrix(half_, grasp.moving_entries(), &inverse_);
  FactorIndependent(inverse_.topLeftCorner(k, k), "J_B' has not full row rank", &inverse_llt_);
  // G Lambda_c G^T = (L_c^-1 G^T)^T (L_c^-1 G^T)
  G_T_ = grasp.G().transpose();
  inverse_llt_.matrixL().solveInPlace(G_T_);
  Lambda_ = grasp.body().M_hat;
  Lambda_.noalias() += G_T_.transpose() * G_T_;
  Lambda_llt_.compute(Lambda_);
}

namespace {

/// diag(k) along the world's axes for the position, about Sigma_o's for the orientation, in Sigma_o.
Matrix6d TurnToObject(const Vector6d& k, const Matrix3d& R_Bo) {
  Matrix6d K = Matrix6d::Zero();
  K.topLeftCorner<3, 3>() = R_Bo.transpose() * k.head<3>().asDiagonal() * R_Bo;
  K.bottomRightCorner<3, 3>() = k.tail<3>().asDiagonal();
  return K;
}

/// D = 2 zeta Q diag(sqrt k) Q^T with Lambda = Q Q^T and K = Q diag(k) Q^T.
Matrix6d CalcDesignedDamping(const Matrix6d& Lambda, const Matrix6d& K, double zeta) {
  // Lambda = L L^T, L^-1 K L^-T = U diag(k) U^T, Q = L U
  const Eigen::LLT<Matrix6d> llt(Lambda);
  Matrix6d scaled = llt.matrixL().solve(K);
  scaled = llt.matrixL().solve(scaled.transpose().eval()).eval();
  Vector6d k;
  Matrix6d U;
  DecomposeSymmetric(scaled, &k, &U);
  const Matrix6d Q = llt.matrixL() * U;
  const Vector6d roots = k.cwiseMax(0.0).cwiseSqrt();
  return 2.0 * zeta * Q * roots.asDiagonal() * Q.transpose();
}

}  // namespace

Vector6d ObjectSpaceInertia::CalcAcceleration(const Vector6d& W) const { return Lambda_llt_.solve(W); }

void ObjectSpaceInertia::MultiplyContactInertia(Eigen::Ref<VectorXd> y) const {
  inverse_llt_.solveInPlace(y);
}

std::string_view NameOf(ControlLaw law) {
  constexpr std::array<std::string_view, 5> kNames = {"computed_torque", "pd_gravity", "feedforward_pd",
                                                      "operational_space", "impedance"};
  return kNames.at(static_cast<size_t>(law));
}

ObjectStiffness CalcStiffness(const ObjectGains& gains, const Matrix6d& Lambda, const Matrix3d& R_Bo) {
  Vector6d inertia = Lambda.diagonal();
  inertia.head<3>() = (R_Bo * Lambda.topLeftCorner<3, 3>() * R_Bo.transpose()).diagonal();
  ObjectStiffness stiffness;
  stiffness.K = gains.K_p.cwiseProduct(inertia);
  stiffness.D = gains.K_v.cwiseProduct(inertia);
  double sum = 0.0;
  int count = 0;
  for (int i = 0; i < 6; ++i) {
    if (!(gains.K_p[i] > 0.0)) continue;
    sum += gains.K_v[i] / (2.0 * std::sqrt(gains.K_p[i]));
    ++count;
  }
  stiffness.damping_ratio = count > 0 ? sum / count : 0.0;
  return stiffness;
}

BaselineLaw::BaselineLaw(const RobotModel& model, int num_contacts, ControlLaw law, const Options& options)
    : law_(law),
      options_(options),
      inertia_(model, num_contacts),
      J_B_pinv_("J_B'", Eigen::Index{3} * num_contacts, model.num_velocities()) {
  const Eigen::Index n = model.num_velocities();
  Require(law != ControlLaw::kComputedTorque, "law", "must be one of the baselines", law);
  if (options.weight.kind == RedundancyWeight::Kind::kDiagonal) {
    Require(options.weight.w.size() == n, "length of w", "must be that of xi", options.weight.w.size());
  }
  for (VectorXd* vector : {&xi_d_, &xi_dot_d_, &force_, &work_}) vector->setZero(n);
  rates_.setZero(Eigen::Index{3} * num_contacts);
}

Vector6d BaselineLaw::CalcWrench(const GraspTerms& grasp, const ObjectErrors& errors) const {
  // W = K e + D V_e
  const Matrix3d& R_Bo = grasp.X_Bo().linear();
  const Matrix6d K = TurnToObject(options_.stiffness.K, R_Bo);
  const Matrix6d D = law_ == ControlLaw::kImpedance
                         ? CalcDesignedDamping(inertia_.Lambda(), K, options_.stiffness.damping_ratio)
                         : TurnToObject(options_.stiffness.D, R_Bo);
  return K * errors.e + D * errors.V_error;
}

void BaselineLaw::SetDemand(const ModelTerms& robot, const GraspTerms& grasp, const DesiredMotion& desired,
                            const Eigen::Ref<const VectorXd>& sigma_prime) {
  Require(sigma_prime.size() == force_.size(), "length of sigma'", "must be that of xi", sigma_prime.size());
  inertia_.Compute(robot, grasp);
  if (law_ == ControlLaw::kOperationalSpace) return SetOperationalSpace(robot, grasp, desired, sigma_prime);
  const bool knows_motion = law_ != ControlLaw::kPdGravity;
  const ObjectErrors errors = CalcObjectErrors(options_.orientation, grasp, desired);
  V_Bo_dot_ = inertia_.CalcAcceleration(CalcWrench(grasp, errors));
  if (knows_motion) V_Bo_dot_ += errors.V_d_dot;
  const Vector6d V_d = grasp.V_Bo() + errors.V_error;

  FactorJacobian(options_.weight, robot, grasp, &J_B_pinv_);
  F_o_ = grasp.body().M_hat * V_Bo_dot_ + grasp.body().N_o;
  if (knows_motion) {
    // xi_d = xi - J^+ (J xi - G^T V_d), J xi - G^T V_d = slip - G^T V_e
    rates_ = grasp.slip();
    rates_.noalias() -= grasp.G().transpose() * errors.V_error;
    J_B_pinv_.Apply(rates_, work_);
    xi_d_ = robot.velocity() - work_;
  }
  // xi_dot_d = J^+ (G_dot^T V_d + G^T V_dot - J_dot xi_d) + N sigma'
  rates_.noalias() = grasp.G().transpose() * V_Bo_dot_;
  if (knows_motion) {
    rates_.noalias() += grasp.G_dot().transpose() * V_d;
    rates_.noalias() -= grasp.J_B_dot() * xi_d_;
    F_o_ += grasp.body().C_hat * V_d;
  }
  J_B_pinv_.Apply(rates_, xi_dot_d_);
  work_ = sigma_prime;
  J_B_pinv_.Project(work_);
  xi_dot_d_ += work_;
  force_ = robot.gravity();
  force_.noalias() += robot.M() * xi_dot_d_;
  if (!knows_motion) return;
  force_ += robot.friction();
  force_.noalias() += robot.C() * xi_d_;
}

void BaselineLaw::SetOperationalSpace(const ModelTerms& robot, const GraspTerms& grasp,
                                      const DesiredMotion& desired,
                                      const Eigen::Ref<const VectorXd>& sigma_prime) {
  V_Bo_dot_ = CalcTrackingAcceleration(options_.gains, options_.orientation, grasp, desired);
  // F_c = Lambda_c (G^T V_dot + G_dot^T V - J_dot xi - J sigma')
  rates_.noalias() = grasp.G().transpose() * V_Bo_dot_;
  rates_ -= grasp.slip_bias();
  rates_.noalias() -= grasp.J_B() * sigma_prime;
  inertia_.MultiplyContactInertia(rates_);
  work_.noalias() = grasp.J_B().transpose() * rates_;
  force_ = work_ + robot.gravity() + robot.friction();
  force_.noalias() += robot.M() * sigma_prime;
  force_.noalias() += robot.C() * robot.velocity();
  // xi_dot_d = sigma' + M_bar'^-1 J^T F_c, M^-1 = L^-1 L^-T
  xi_dot_d_ = work_;
  inertia_.mass_factor().SolveTransposed(xi_dot_d_);
  inertia_.mass_factor().Solve(xi_dot_d_);
  xi_dot_d_ += sigma_prime;
  F_o_ = grasp.body().M_hat * V_Bo_dot_ + grasp.body().C_hat * grasp.V_Bo() + grasp.body().N_o;
}

}  // namespace dexcheck
