#include "controller/control/constrained_dynamics.h"

#include <algorithm>

#include "controller/common/errors.h"
#include "controller/common/linear_algebra.h"

namespace dexcheck {
namespace {

// Pivots of L^-T J^T below this, against the largest, are rounding: constraints that others hold already.
constexpr double kRedundant = 1e-8;

}  // namespace

ConstrainedDynamics::ConstrainedDynamics(const RobotModel& model, int num_contacts)
    : factor_(model), schur_llt_(std::max(Eigen::Index{3} * num_contacts, Eigen::Index{0})) {
  Require(num_contacts >= 0, "number of contacts", "must not be negative", num_contacts);
  const Eigen::Index n = model.num_velocities();
  const Eigen::Index k = Eigen::Index{3} * num_contacts;
  rows_.reserve(static_cast<size_t>(n + 6));
  half_.setZero(n + 6, PadToGramBlock(k));
  schur_.setZero(half_.cols(), half_.cols());
  motion_.setZero(n + 6);
  bias_.setZero(n);
  prediction_.xi_dot.setZero(n);
  prediction_.f_c.setZero(k);
}

const Prediction& ConstrainedDynamics::Predict(const ModelTerms& robot, const GraspTerms& grasp,
                                               const Eigen::Ref<const VectorXd>& force, ObjectSupport object,
                                               const VectorXd* contact_acceleration, const Vector6d* push) {
  const Eigen::Index n = prediction_.xi_dot.size();
  Require(robot.size() == n && force.size() == n, "length of force", "must be that of xi", force.size());
  const Eigen::Index k = prediction_.f_c.size();
  Require(grasp.num_forces() == k && k > 0, "number of contact forces", "must be as constructed and positive",
          grasp.num_forces());
  const ObjectBodyTerms& body = grasp.body();
  factor_.Compute(robot.M());
  const Eigen::LLT<Matrix6d> M_hat_llt(body.M_hat);

  // M = L^T L of the robot, L L^T of the object; half = M^-1/2 [J_B'^T; -G], and M^-1/2 of what the
  // constraints leave alone
  const std::span<const int> moving = grasp.moving_entries();
  for (const int i : moving) half_.row(i).head(k) = grasp.J_B().col(i).transpose();
  CalcFreeForce(robot, force);
  if (object == ObjectSupport::kHand) {
    half_.bottomLeftCorner(6, k) = -grasp.G();
    motion_.tail<6>() = -body.C_hat * grasp.V_Bo() - body.N_o;
    if (push != nullptr) motion_.tail<6>() += *push;
  } else {
    half_.bottomRows<6>().setZero();
    motion_.tail<6>().setZero();
  }
  factor_.SolveTransposedColumns(moving, half_.topRows(n));
  factor_.SolveTransposed(motion_.head(n));
  M_hat_llt.matrixL().solveInPlace(half_.bottomRows<6>());
  M_hat_llt.matrixL().solveInPlace(motion_.tail<6>());

  // (half^T half) f_c = half^T M^-1/2 force + slip_bias - contact_acceleration
  rows_.assign(moving.begin(), moving.end());
  for (Eigen::Index i = n; i < n + 6; ++i) rows_.push_back(static_cast<int>(i));
  CalcGramMatrix(half_, rows_, &schur_);
  prediction_.f_c = grasp.slip_bias();
  if (contact_acceleration != nullptr) prediction_.f_c -= *contact_acceleration;
  for (const int i : rows_) prediction_.f_c += motion_[i] * half_.row(i).head(k).transpose();
  FactorIndependent(schur_.topLeftCorner(k, k), "contact constraints depend on each other", &schur_llt_);
  schur_llt_.solveInPlace(prediction_.f_c);

  // [xi_dot; V_Bo_dot] = M^-1/2 (M^-1/2 force - half f_c)
  for (const int i : rows_) motion_[i] -= half_.row(i).head(k).dot(prediction_.f_c);
  prediction_.xi_dot = motion_.head(n);
  factor_.Solve(prediction_.xi_dot);
  prediction_.V_Bo_dot = motion_.tail<6>();
  M_hat_llt.matrixU().solveInPlace(prediction_.V_Bo_dot);
  return prediction_;
}

const Prediction& ConstrainedDynamics::PredictFree(const ModelTerms& robot,
                                                   const Eigen::Ref<const VectorXd>& force) {
  const Eigen::Index n = prediction_.xi_dot.size();
  Require(robot.size() == n && force.size() == n, "length of force", "must be that of xi", force.size());
  factor_.Compute(robot.M());
  CalcFreeForce(robot, force);
  prediction_.xi_dot = motion_.head(n);
  factor_.SolveTransposed(prediction_.xi_dot);
  factor_.Solve(prediction_.xi_dot);
  prediction_.V_Bo_dot.setZero();
  prediction_.f_c.setZero();
  return prediction_;
}

void ConstrainedDynamics::CalcFreeForce(const ModelTerms& robot, const Eigen::Ref<const VectorXd>& force) {
  auto free = motion_.head(prediction_.xi_dot.size());
  bias_ = robot.gravity() + robot.friction();
  bias_.noalias() += robot.C() * robot.velocity();
  free = force - bias_;
}

GroundDynamics::GroundDynamics(const RobotModel& model, int feet) : factor_(model), constraints_(kRedundant) {
  half_.setZero(model.num_velocities(), Eigen::Index{3} * feet);
}

const Prediction& GroundDynamics::Predict(const ModelTerms& robot, const GroundContacts& ground,
                                          const Eigen::Ref<const VectorXd>& force) {
  factor_.Compute(robot.M());
  // y = L xi_dot: y = y_free + B^T f and B y = -J_dot xi, with B = J L^-1
  VectorXd y = force - robot.gravity() - robot.friction();
  y.noalias() -= robot.C() * robot.velocity();
  factor_.SolveTransposed(y);
  half_ = ground.J().transpose();
  factor_.SolveTransposedColumns(half_);
  constraints_.Compute(half_.transpose());
  VectorXd made = -ground.J_dot_xi();
  made.noalias() -= half_.transpose() * y;
  const VectorXd change = constraints_.Solve(made);  // B^T f
  prediction_.f_c = constraints_.SolveTransposed(change);
  prediction_.xi_dot = y + change;
  factor_.Solve(prediction_.xi_dot);
  return prediction_;
}

}  // namespace dexcheck
