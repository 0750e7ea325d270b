#include "controller/control/constrained_dynamics.h"

#include <algorithm>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/object/euler_zyz.h"

namespace dexcheck {
namespace {

// Smallest pivot of the Schur complement, against its diagonal entry, that counts as regular: a constraint of
// which less than this is independent of the others loses half of its digits or more.
constexpr double kMinPivotRatio = 1e-8;

void RequireIndependentConstraints(const MatrixXd& schur, const Eigen::LLT<MatrixXd>& llt) {
  double smallest = 0.0;
  if (llt.info() == Eigen::Success) {
    smallest = 1.0;
    for (Eigen::Index i = 0; i < schur.rows(); ++i) {
      const double pivot = llt.matrixLLT()(i, i);
      smallest = std::min(smallest, pivot * pivot / schur(i, i));
    }
  }
  if (smallest > kMinPivotRatio) return;
  throw SingularityError(
      "contact constraints depend on each other, smallest independent part " + FormatNumber(smallest),
      smallest);
}

}  // namespace

Vector6d CalcCoordinateAcceleration(const GraspTerms& grasp, const Vector6d& V_Bo_dot) {
  return CalcP(grasp.X_o()) * (V_Bo_dot - grasp.coordinates().P_inv_dot * grasp.X_o_dot());
}

ConstrainedDynamics::ConstrainedDynamics(const RobotModel& model, int num_contacts) : factor_(model) {
  Require(num_contacts >= 0, "number of contacts", "must not be negative", num_contacts);
  const Eigen::Index n = model.num_velocities();
  const Eigen::Index k = Eigen::Index{3} * num_contacts;
  half_.setZero(n + 6, k);
  half_force_.setZero(n + 6, 1);
  schur_.setZero(k, k);
  schur_llt_ = Eigen::LLT<MatrixXd>(k);
  motion_.setZero(n + 6);
  prediction_.xi_dot.setZero(n);
  prediction_.f_c.setZero(k);
}

const Prediction& ConstrainedDynamics::Predict(const ModelTerms& robot, const GraspTerms& grasp,
                                               const Eigen::Ref<const VectorXd>& force, ObjectSupport object,
                                               const VectorXd* contact_acceleration, const Vector6d* push) {
  const Eigen::Index n = prediction_.xi_dot.size();
  Require(robot.size() == n && force.size() == n, "length of force", "must be that of xi",
          static_cast<double>(force.size()));
  Require(grasp.num_forces() == schur_.rows() && grasp.num_forces() > 0, "number of contact forces",
          "must be as constructed and positive", grasp.num_forces());
  const ObjectBodyTerms& body = grasp.body();
  factor_.Compute(robot.M());
  const Eigen::LLT<Matrix6d> M_hat_llt(body.M_hat);

  // M = L^T L of the robot, L L^T of the object; half = M^-1/2 [J_B'^T; -G], and M^-1/2 of what the
  // constraints leave alone
  const std::span<const int> moving = grasp.moving_entries();
  half_.topRows(n).setZero();
  for (const int i : moving) half_.row(i) = grasp.J_B().col(i).transpose();
  CalcFreeForce(robot, force);
  if (object == ObjectSupport::kHand) {
    half_.bottomRows<6>() = -grasp.G();
    motion_.tail<6>() = -body.C_hat * grasp.V_Bo() - body.N_o;
    if (push != nullptr) motion_.tail<6>() += *push;
  } else {
    half_.bottomRows<6>().setZero();
    motion_.tail<6>().setZero();
  }
  half_force_ = motion_;
  factor_.SolveTransposed(moving, half_.topRows(n));
  factor_.SolveTransposed(half_force_.topRows(n));
  M_hat_llt.matrixL().solveInPlace(half_.bottomRows<6>());
  M_hat_llt.matrixL().solveInPlace(half_force_.bottomRows<6>());

  // (half^T half) f_c = half^T half_force + slip_bias - contact_acceleration
  schur_.setZero();
  prediction_.f_c = grasp.slip_bias();
  if (contact_acceleration != nullptr) prediction_.f_c -= *contact_acceleration;
  const auto add_row = [&](Eigen::Index i) {
    for (Eigen::Index col = 0; col < schur_.cols(); ++col) {
      schur_.col(col).tail(schur_.rows() - col) +=
          half_(i, col) * half_.row(i).tail(schur_.rows() - col).transpose();
    }
    prediction_.f_c += half_force_(i, 0) * half_.row(i).transpose();
  };
  for (const int i : moving) add_row(i);
  for (Eigen::Index i = n; i < n + 6; ++i) add_row(i);
  schur_llt_.compute(schur_);
  RequireIndependentConstraints(schur_, schur_llt_);
  schur_llt_.solveInPlace(prediction_.f_c);

  // [xi_dot; V_Bo_dot] = M^-1/2 (half_force - half f_c)
  motion_ = half_force_;
  for (const int i : moving) motion_[i] -= half_.row(i).dot(prediction_.f_c);
  for (Eigen::Index i = n; i < n + 6; ++i) motion_[i] -= half_.row(i).dot(prediction_.f_c);
  prediction_.xi_dot = motion_.head(n);
  factor_.Solve(prediction_.xi_dot);
  prediction_.V_Bo_dot = motion_.tail<6>();
  M_hat_llt.matrixU().solveInPlace(prediction_.V_Bo_dot);
  return prediction_;
}

const Prediction& ConstrainedDynamics::PredictFree(const ModelTerms& robot,
                                                   const Eigen::Ref<const VectorXd>& force) {
  const Eigen::Index n = prediction_.xi_dot.size();
  Require(robot.size() == n && force.size() == n, "length of force", "must be that of xi",
          static_cast<double>(force.size()));
  factor_.Compute(robot.M());
  CalcFreeForce(robot, force);
  half_force_.topRows(n) = motion_.head(n);
  factor_.SolveTransposed(half_force_.topRows(n));
  prediction_.xi_dot = half_force_.topRows(n);
  factor_.Solve(prediction_.xi_dot);
  prediction_.V_Bo_dot.setZero();
  prediction_.f_c.setZero();
  return prediction_;
}

void ConstrainedDynamics::CalcFreeForce(const ModelTerms& robot, const Eigen::Ref<const VectorXd>& force) {
  auto free = motion_.head(prediction_.xi_dot.size());
  free = force - robot.gravity() - robot.friction();
  free.noalias() -= robot.C() * robot.velocity();
}

ObjectSpaceTerms CalcObjectSpaceTerms(const ModelTerms& robot, const GraspTerms& grasp,
                                      const Pseudoinverse& J_B_pinv, const Eigen::Ref<const VectorXd>& sigma,
                                      const Eigen::Ref<const VectorXd>& sigma_prime) {
  const ObjectTerms& o = grasp.coordinates();
  const MatrixXd J_plus = J_B_pinv.CalcMatrix();
  const MatrixXd N = J_B_pinv.CalcProjector();
  // H = J_B'^+ G^T
  const MatrixXd H = J_plus * grasp.G().transpose();
  const MatrixXd H_P_inv = H * o.P_inv;
  const VectorXd N_sigma = N * sigma;

  ObjectSpaceTerms terms;
  terms.G_J_T = H.transpose();
  // M_tilde = M_o + G J^+T M_bar' J^+ G^T P^-1
  terms.M_tilde = o.M_o + terms.G_J_T * robot.M() * H_P_inv;
  // C_tilde = C_o + G J^+T (M_bar' J^+ (G_dot^T P^-1 + G^T d/dt(P^-1) - J_dot J^+ G^T P^-1) + C_bar' J^+ G^T
  // P^-1)
  const MatrixXd H_rate = J_plus * (grasp.G_dot().transpose() * o.P_inv +
                                    grasp.G().transpose() * o.P_inv_dot - grasp.J_B_dot() * H_P_inv);
  terms.C_tilde = o.C_o + terms.G_J_T * (robot.M() * H_rate + robot.C() * H_P_inv);
  // N_tilde = N_o + G J^+T (F_bar' - M_bar' J^+ J_dot N sigma + M_bar' N sigma' + C_bar' N sigma)
  const VectorXd null_acceleration = N * sigma_prime - J_plus * (grasp.J_B_dot() * N_sigma);
  terms.N_tilde = o.N_o + terms.G_J_T * (robot.gravity() + robot.friction() + robot.M() * null_acceleration +
                                         robot.C() * N_sigma);
  return terms;
}

}  // namespace dexcheck
