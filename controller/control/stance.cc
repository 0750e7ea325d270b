#include "controller/control/stance.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/linear_algebra.h"
#include "controller/control/trajectory_controller.h"
#include "controller/object/so3.h"

namespace dexcheck {
namespace {

constexpr int kMostIterations = 30;
constexpr double kConverged = 1e-14;  // m
constexpr double kDependent = 1e-9;   // of the largest pivot: rows that others have already

Eigen::Quaterniond ReadTurn(const Eigen::Ref<const VectorXd>& q) { return {q[3], q[4], q[5], q[6]}; }

/// Decomposes the columns of J that belong to joints.
LeastSquares SolveForJoints(const MatrixXd& J) {
  return LeastSquares(kDependent).Compute(J.rightCols(J.cols() - 6));
}

/// omega = E rates along the turned axes, of R = R_z(yaw) R_y(pitch) R_x(roll), and E_dot.
void CalcRateMaps(const Vector3d& angles, const Vector3d& rates, Matrix3d* E, Matrix3d* E_dot) {
  const double cr = std::cos(angles[0]), sr = std::sin(angles[0]);
  const double cp = std::cos(angles[1]), sp = std::sin(angles[1]);
  *E << 1.0, 0.0, -sp, 0.0, cr, sr * cp, 0.0, -sr, cr * cp;
  *E_dot << 0.0, 0.0, -cp * rates[1], 0.0, -sr * rates[0], cr * cp * rates[0] - sr * sp * rates[1], 0.0,
      -cr * rates[0], -sr * cp * rates[0] - cr * sp * rates[1];
}

}  // namespace

StanceForces::StanceForces(const RobotModel& model, const Stance& stance)
    : ground_(model, stance.feet, stance.height),
      problem_(static_cast<int>(stance.feet.size())),
      solver_(static_cast<int>(stance.feet.size())) {
  Require(model.base().type == BaseType::kFloating, "base", "must float", model.num_base_velocities());
  problem_.mu.setConstant(stance.mu);
  problem_.f_min.setConstant(stance.f_min);
  problem_.f_max.setConstant(stance.f_max);
  f_.setZero(ground_.J().rows());
}

void StanceForces::TakeOff(const ModelTerms& robot, Eigen::Ref<VectorXd> force) {
  ground_.SetState(robot);
  problem_.G = ground_.J().leftCols<6>().transpose();
  problem_.F_o = force.head<6>();
  const GraspForceResult& result = solver_.Solve(problem_);
  if (result.status != GraspForceStatus::kOptimal)
    throw GraspForceError(
        "no forces of the ground inside the friction cones do what the law wants of the robot");
  // The solver leaves 1e-10 of F_b, and a law is exact to rounding.
  const Matrix6d gram = problem_.G * problem_.G.transpose();
  f_ = result.f_c;
  f_ += problem_.G.transpose() * gram.llt().solve(Vector6d(problem_.F_o - problem_.G * result.f_c));
  force.noalias() -= ground_.J().transpose() * f_;
}

StanceMotion::StanceMotion(const RobotModel& model, const Stance& stance, const VectorXd& q_start,
                           JointMotion body)
    : model_(&model), stance_(stance), q_start_(q_start), body_(std::move(body)) {
  ModelTerms robot(model);
  robot.SetState(q_start, VectorXd::Zero(model.num_velocities()));
  for (const int foot : stance.feet) X_WF_start_.push_back(robot.CalcFramePose(foot));
}

void StanceMotion::Evaluate(double t, DesiredJoints* desired) const {
  const Eigen::Index n = model_->num_velocities();
  DesiredJoints body;
  body_.Evaluate(t, &body);
  const Vector3d angles = body.q.tail<3>(), rates = body.q_dot.tail<3>();
  Matrix3d E, E_dot;
  CalcRateMaps(angles, rates, &E, &E_dot);
  const Eigen::Quaterniond turn(TurnRollPitchYaw(angles) * ReadTurn(q_start_).toRotationMatrix());
  const Matrix3d R_start = ReadTurn(q_start_).toRotationMatrix().transpose();
  VectorXd& q = desired->q;
  q = q_start_;
  q.head<3>() += body.q.head<3>();
  q.segment<4>(3) << turn.w(), turn.x(), turn.y(), turn.z();
  VectorXd& xi = desired->q_dot;
  VectorXd& xi_dot = desired->q_ddot;
  xi.setZero(n);
  xi_dot.setZero(n);

  ModelTerms robot(*model_);
  GroundContacts ground(*model_, stance_.feet, stance_.height);
  VectorXd way(ground.J().rows());
  for (int k = 0; k < kMostIterations; ++k) {
    robot.SetState(q, xi);
    ground.SetState(robot);
    for (int i = 0; i < ground.count(); ++i) {
      // The contact point has moved by the centre's displacement plus theta x a, a = -r n.
      const Pose& X_start = X_WF_start_[static_cast<size_t>(i)];
      const Pose& X = ground.X_WF(i);
      const Vector3d theta = X_start.linear() * LogSo3(X_start.linear().transpose() * X.linear());
      way.segment<3>(3 * i) =
          X.translation() - X_start.translation() - ground.radius(i) * theta.cross(Vector3d::UnitZ());
    }
    if (way.lpNorm<Eigen::Infinity>() < kConverged) break;
    q.tail(n - 6) -= SolveForJoints(ground.J()).Solve(way);
  }
  const LeastSquares joints = SolveForJoints(ground.J());
  xi.head<3>() = body.q_dot.head<3>();
  xi.segment<3>(3) = R_start * (E * rates);
  xi.tail(n - 6) = -joints.Solve(ground.J().leftCols<6>() * xi.head<6>());
  xi_dot.head<3>() = body.q_ddot.head<3>();
  xi_dot.segment<3>(3) = R_start * (E * body.q_ddot.tail<3>() + E_dot * rates);
  robot.SetState(q, xi);
  ground.SetState(robot);
  xi_dot.tail(n - 6) = -joints.Solve(ground.J().leftCols<6>() * xi_dot.head<6>() + ground.J_dot_xi());
}

double PutFeetDown(const RobotModel& model, const Stance& stance, VectorXd* q) {
  const Eigen::Index n = model.num_velocities();
  ModelTerms robot(model);
  GroundContacts ground(model, stance.feet, stance.height);
  const VectorXd rest = VectorXd::Zero(n);
  for (int k = 0; k < kMostIterations; ++k) {
    robot.SetState(*q, rest);
    ground.SetState(robot);
    if (ground.gap().lpNorm<Eigen::Infinity>() < kConverged) break;
    // Up and down alone: feet that are to lie flat turn.
    const MatrixXd J = ground.J()(Eigen::seq(2, Eigen::last, 3), Eigen::all);
    q->tail(n - 6) -= SolveForJoints(J).Solve(ground.gap());
  }
  return ground.gap().lpNorm<Eigen::Infinity>();
}

void CalcPositionError(bool floats, const Eigen::Ref<const VectorXd>& q_d,
                       const Eigen::Ref<const VectorXd>& q, Eigen::Ref<VectorXd> error) {
  if (!floats) {
    error = q_d - q;
    return;
  }
  error.head<3>() = q_d.head<3>() - q.head<3>();
  error.segment<3>(3) =
      LogSo3((ReadTurn(q).normalized().conjugate() * ReadTurn(q_d).normalized()).toRotationMatrix());
  error.tail(error.size() - 6) = q_d.tail(q_d.size() - 7) - q.tail(q.size() - 7);
}

}  // namespace dexcheck
