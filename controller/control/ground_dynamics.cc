#include "controller/control/ground_dynamics.h"

#include <cmath>

namespace dexcheck {
namespace {

// Pivots of L^-T J^T below this, against the largest, are rounding: constraints that others hold already.
constexpr double kRedundant = 1e-8;

}  // namespace

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

double GroundDynamics::CalcForceGain() const {
  return 1.0 / std::sqrt(CalcSymmetricEigenvalues(half_.transpose() * half_)[0]);
}

}  // namespace dexcheck
