#include "harness/diagnosis/step_forces.h"

#include <Eigen/SVD>
#include <cmath>
#include <limits>
#include <utility>

namespace dexcheck {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;

RobotModel AddBodyFrames(const RobotModel& model) {
  RobotSpec spec = model.spec();
  for (int link = -1; link < model.num_joints(); ++link) {
    Frame frame;
    frame.name = "centre of mass of " + model.link_name(link);
    frame.link = link;
    frame.X_LF.translation() =
        link < 0 ? model.base_with_wheels().com : model.joints()[static_cast<size_t>(link)].body.com;
    spec.frames.push_back(frame);
  }
  return RobotModel(std::move(spec));
}

}  // namespace

Vector2d StepNoise::CalcNoise(const Vector2d& level) const {
  return level.cwiseProduct(bounds).cwiseMax(std::numeric_limits<double>::min());
}

ArrayXd StepNoise::CalcSpread(const Vector2d& level) const {
  return (1.0 + (sizes / CalcNoise(level)[0]).array().square()).sqrt();
}

void StepNoise::Scale(const Vector2d& by, const ArrayXd& along, Eigen::Ref<MatrixXd> rows) const {
  auto robot = rows.topRows(rows.rows() - 6);
  robot *= by[0];
  rows.bottomRows<6>() *= by[1];
  if (uneven.cols() == 0) return;
  const MatrixXd change = (along - 1.0).matrix().asDiagonal() * (uneven.transpose() * robot);
  robot.noalias() += uneven * change;
}

void StepNoise::Divide(const Vector2d& level, Eigen::Ref<MatrixXd> rows) const {
  Scale(CalcNoise(level).cwiseInverse(), CalcSpread(level).inverse(), rows);
}

void StepNoise::ChangeLevel(const Vector2d& from, const Vector2d& to, Eigen::Ref<MatrixXd> rows) const {
  Scale(CalcNoise(from).cwiseQuotient(CalcNoise(to)), CalcSpread(from) / CalcSpread(to), rows);
}

StepForces::StepForces(const StepStore& store)
    : store_(store),
      model_(AddBodyFrames(store.setup().declared_model())),
      terms_(model_),
      factor_(model_),
      actuation_(model_),
      n_(model_.num_velocities()),
      first_link_(model_.base().type == BaseType::kFixed ? 0 : -1),
      gravity_(model_.gravity()) {
  for (int link = first_link_; link < model_.num_joints(); ++link) {
    const MassProperties& body =
        link < 0 ? model_.base_with_wheels() : model_.joints()[static_cast<size_t>(link)].body;
    links_.push_back({Matrix6Xd::Zero(6, n_), Matrix6Xd::Zero(6, n_), Pose::Identity(), &body});
    mass_ += body.mass;
  }
  if (store.setup().has_object()) mass_ += store.setup().declared_object().body.mass;
  constexpr double kEarth = 10.0;  // m/s^2
  weight_ = kEarth * mass_;
}

bool StepForces::SetGravity(const Vector3d& gravity) {
  constexpr double kSame = 1e-9;
  const double change = (std::exchange(gravity_, gravity) - gravity).norm();
  return change > kSame * gravity.norm();
}

void StepForces::SetStep(Index step) {
  step_ = step;
  terms_.SetState(store_.Get(StepStore::kPosition).col(step), store_.Get(StepStore::kVelocity).col(step));
  terms_.CalcDynamics();
  factor_.Compute(terms_.M());
  const int first_frame = static_cast<int>(model_.frames().size() - links_.size());
  for (size_t i = 0; i < links_.size(); ++i) {
    const int frame = first_frame + static_cast<int>(i);
    terms_.CalcFrameJacobian(frame, links_[i].J, links_[i].J_dot);
    links_[i].X = terms_.CalcFramePose(frame);
    for (size_t k = 0; k < i; ++k)
      reach_ = std::max(reach_, (links_[i].X.translation() - links_[k].X.translation()).norm());
  }
  noise_.bounds = store_.Get(StepStore::kNoise).col(step);
  const ObjectModel& object = store_.setup().declared_object();
  arm_ = std::sqrt(object.body.inertia.trace() / object.body.mass);
  CalcUneven();
}

Turns StepForces::ListTurns() const {
  Turns turns;
  for (const Link& link : links_) turns.push_back(link.X.linear());
  turns.emplace_back(store_.Get(StepStore::kObjectPose).col(step_).head<9>().reshaped(3, 3));
  return turns;
}

void StepForces::CalcUneven() {
  const double size = store_.Get(StepStore::kUneven)(0, step_);
  noise_.uneven.resize(n_, 0);
  noise_.sizes.resize(0);
  if (!(size > 0.0) || first_link_ == 0) return;
  // An acceleration a of the platform, and alpha about it, is one of a + alpha x r of each link.
  MatrixXd U = MatrixXd::Zero(n_, 8);
  const Vector3d origin = links_.front().X.translation();
  for (const Link& link : links_) {
    const Matrix3d R_T = link.X.linear().transpose();
    for (Index k = 0; k < 3; ++k) {
      const Vector3d e = Vector3d::Unit(k);
      Vector6d linear, angular;
      linear << link.body->mass * R_T * e, Vector3d::Zero();
      angular << link.body->mass * R_T * e.cross(link.X.translation() - origin), link.body->inertia * R_T * e;
      U.col(k) += link.J.transpose() * linear;
      U.col(3 + k) += link.J.transpose() * angular;
    }
  }
  for (Index k = 0; k < 2; ++k) U(k, 6 + k) = 1.0;
  for (Index k = 0; k < U.cols(); ++k) {
    VectorXd column = U.col(k);
    factor_.SolveTransposed(column);
    const double norm = column.norm();
    U.col(k) = norm > 0.0 ? VectorXd(size / norm * column) : VectorXd(VectorXd::Zero(n_));
  }
  const Eigen::JacobiSVD<MatrixXd> svd(U, Eigen::ComputeThinU);
  noise_.uneven = svd.matrixU();
  noise_.sizes = svd.singularValues();
}

bool StepForces::Differs(const VectorXd& residual) const {
  VectorXd robot = store_.Get(StepStore::kRobotResidual).col(step_);
  factor_.SolveTransposed(robot);
  const double root = std::sqrt(static_cast<double>(n_));
  return robot.norm() > root * level_[0] * noise_.bounds[0] + store_.Get(StepStore::kUneven)(0, step_) ||
         residual.head(n_).norm() > root || residual.tail<6>().norm() > std::sqrt(6.0);
}

VectorXd StepForces::CalcResidual() const {
  VectorXd y(rows());
  y << store_.Get(StepStore::kRobotResidual).col(step_), store_.Get(StepStore::kObjectResidual).col(step_);
  Whiten(y);
  return y;
}

void StepForces::Whiten(Eigen::Ref<MatrixXd> f_w) const {
  for (Index k = 0; k < f_w.cols(); ++k) factor_.SolveTransposed(f_w.col(k).head(n_));
  if (store_.setup().has_object()) {
    f_w.bottomRows<3>() /= arm_;
  } else {
    f_w.bottomRows<6>().setZero();
  }
  noise_.Divide(level_, f_w);
}

}  // namespace dexcheck
