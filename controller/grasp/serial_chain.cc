#include "controller/grasp/serial_chain.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "controller/common/errors.h"
#include "controller/object/so3.h"

namespace dexcheck::grasp_internal {

std::vector<std::vector<int>> ListOwnJoints(const RobotModel& model, std::span<const int> fingertips) {
  std::vector<int> users(static_cast<size_t>(model.num_joints()), 0);
  for (const int frame : fingertips) {
    for (const int joint : model.ListChain(model.frame(frame).link)) ++users[static_cast<size_t>(joint)];
  }
  std::vector<std::vector<int>> own(fingertips.size());
  for (size_t i = 0; i < fingertips.size(); ++i) {
    std::vector<int> chain = model.ListChain(model.frame(fingertips[i]).link);
    std::ranges::reverse(chain);
    for (const int joint : chain) {
      if (users[static_cast<size_t>(joint)] == 1) own[i].push_back(joint);
    }
    if (own[i].empty()) throw std::invalid_argument("fingertips: a finger has no joints of its own");
  }
  return own;
}

SerialChain::SerialChain(const RobotModel& model, int frame, std::span<const int> joints,
                         const Eigen::Ref<const VectorXd>& q)
    : q_offset_(model.num_base_positions()) {
  Require(q.size() == model.num_positions(), "q", "must have an entry for each position", q.size());
  Pose held = model.CalcBasePose(q);
  for (const int index : model.ListChain(model.frame(frame).link)) {
    const Joint& joint = model.joint(index);
    const bool revolute = joint.type == JointType::kRevolute;
    held = held * joint.X_PB;
    if (std::ranges::find(joints, index) == joints.end()) {
      const double position = q[q_offset_ + index];
      held = held * CalcMdhTransform(joint.mdh.alpha, joint.mdh.a, joint.mdh.q + (revolute ? position : 0.0),
                                     joint.mdh.d + (revolute ? 0.0 : position));
      continue;
    }
    joints_.push_back(index);
    // The fixed part of the MDH row comes before the joint: rotations about and translations along z commute.
    const MdhRow& mdh = joint.mdh;
    held = held * CalcMdhTransform(mdh.alpha, mdh.a, revolute ? 0.0 : mdh.q, revolute ? mdh.d : 0.0);
    segments_.push_back({held, revolute, revolute ? mdh.q : mdh.d});
    held = Pose::Identity();
  }
  after_ = held * model.frame(frame).X_LF;
  if (joints_.size() != joints.size() || joints.empty()) {
    throw std::invalid_argument("joints: each must move frame " + model.frame(frame).name + ", once");
  }
  range_.lower.resize(size());
  range_.upper.resize(size());
  for (Eigen::Index k = 0; k < size(); ++k) {
    const Joint& joint = model.joint(joints_[static_cast<size_t>(k)]);
    range_.lower[k] = joint.lower;
    range_.upper[k] = joint.upper;
  }
}

void SerialChain::CalcPoses(const Eigen::Ref<const VectorXd>& q, Poses* poses) const {
  poses->links.resize(segments_.size());
  Pose X = Pose::Identity();
  for (size_t k = 0; k < segments_.size(); ++k) {
    const Segment& segment = segments_[k];
    X = X * segment.before;
    const double position = segment.offset + q[static_cast<Eigen::Index>(k)];
    if (segment.revolute) {
      const double c = std::cos(position);
      const double s = std::sin(position);
      const Vector3d x = X.linear().col(0);
      X.linear().col(0) = c * x + s * X.linear().col(1);
      X.linear().col(1) = c * X.linear().col(1) - s * x;
    } else {
      X.translation() += position * X.linear().col(2);
    }
    poses->links[k] = X;
  }
  poses->frame = X * after_;
}

void SerialChain::CalcJacobian(const Poses& poses, Matrix6Xd* J) const {
  J->resize(6, size());
  for (Eigen::Index k = 0; k < size(); ++k) {
    const Pose& X = poses.links[static_cast<size_t>(k)];
    const Vector3d z = X.linear().col(2);
    if (segments_[static_cast<size_t>(k)].revolute) {
      J->col(k) << z.cross(poses.frame.translation() - X.translation()), z;
    } else {
      J->col(k) << z, Vector3d::Zero();
    }
  }
}

VectorXd SerialChain::Gather(const Eigen::Ref<const VectorXd>& q) const {
  VectorXd own(size());
  for (Eigen::Index k = 0; k < size(); ++k) own[k] = q[q_offset_ + joints_[static_cast<size_t>(k)]];
  return own;
}

void SerialChain::Scatter(const Eigen::Ref<const VectorXd>& q_own, Eigen::Ref<VectorXd> q) const {
  for (Eigen::Index k = 0; k < size(); ++k) q[q_offset_ + joints_[static_cast<size_t>(k)]] = q_own[k];
}

namespace {

constexpr double kLargestStep = 0.3;  // rad or m

/// One chain on its way to one target.
class ChainSolver {
 public:
  ChainSolver(const SerialChain& chain, const ChainTarget& target, const JointRange& range,
              const VectorXd& q_start)
      : chain_(chain), target_(target), range_(range) {
    result_.q = q_start.cwiseMax(range.lower).cwiseMin(range.upper);
    SetError();
  }

  [[nodiscard]] double error() const { return error_.norm(); }
  [[nodiscard]] bool IsAtTarget() const {
    return result_.position <= target_.tolerance && result_.orientation <= target_.tolerance;
  }

  /// Moves towards the target, and by `pull` of the way to q_nominal where the target does not care. Returns
  /// the largest change of a joint.
  double Step(const VectorXd* q_nominal, double pull) {
    chain_.CalcJacobian(poses_, &J_);
    J_.bottomRows<3>() *= target_.length;
    free_.assign(static_cast<size_t>(chain_.size()), true);
    // A joint at the end of its range that wants to go on is held, and the others take over.
    for (Eigen::Index held = 0; held <= chain_.size(); ++held) {
      CalcStep(q_nominal, pull);
      if (!HoldJointsAtEnds()) break;
    }
    const double largest = step_.cwiseAbs().maxCoeff();
    if (largest > kLargestStep) step_ *= kLargestStep / largest;
    const VectorXd before = result_.q;
    result_.q = (result_.q + step_).cwiseMax(range_.lower).cwiseMin(range_.upper);
    SetError();
    return (result_.q - before).cwiseAbs().maxCoeff();
  }

  ChainSolution Finish() {
    // Rounding of coordinates may keep the residual a little above a very small tolerance.
    const double rounding =
        32.0 * std::numeric_limits<double>::epsilon() * (1.0 + target_.X.translation().norm());
    const double tolerance = std::max(target_.tolerance, rounding);
    result_.reached = result_.position <= tolerance && result_.orientation <= tolerance;
    return result_;
  }

 private:
  void SetError() {
    chain_.CalcPoses(result_.q, &poses_);
    error_.head<3>() = target_.X.translation() - poses_.frame.translation();
    result_.position = error_.head<3>().norm();
    const Vector3d turn = LogSo3(target_.X.linear() * poses_.frame.linear().transpose());
    result_.orientation = turn.norm();
    error_.tail<3>() = target_.length * turn;
  }

  // step = J^T (J J^T + lambda)^-1 error + (1 - J^T (J J^T + lambda)^-1 J) pull (q_nominal - q)
  void CalcStep(const VectorXd* q_nominal, double pull) {
    constexpr double kDamping = 1e-2;
    constexpr double kLeast = 1e-13;
    step_.setZero(chain_.size());
    if (q_nominal != nullptr) step_ = pull * (*q_nominal - result_.q);
    Matrix6d normal = Matrix6d::Zero();
    Vector6d rhs = error_;
    for (Eigen::Index k = 0; k < chain_.size(); ++k) {
      if (!free_[static_cast<size_t>(k)]) {
        step_[k] = 0.0;
        continue;
      }
      const Vector6d column = J_.col(k);
      normal += column * column.transpose();
      rhs -= column * step_[k];
    }
    normal.diagonal().array() += kDamping * error_.squaredNorm() + kLeast;
    const Vector6d y = normal.ldlt().solve(rhs);
    for (Eigen::Index k = 0; k < chain_.size(); ++k) {
      if (free_[static_cast<size_t>(k)]) step_[k] += J_.col(k).dot(y);
    }
  }

  bool HoldJointsAtEnds() {
    bool held = false;
    for (Eigen::Index k = 0; k < chain_.size(); ++k) {
      const bool leaves = (result_.q[k] <= range_.lower[k] && step_[k] < 0.0) ||
                          (result_.q[k] >= range_.upper[k] && step_[k] > 0.0);
      if (!leaves || !free_[static_cast<size_t>(k)]) continue;
      free_[static_cast<size_t>(k)] = false;
      held = true;
    }
    return held;
  }

  const SerialChain& chain_;
  const ChainTarget& target_;
  const JointRange& range_;
  ChainSolution result_;
  SerialChain::Poses poses_;
  Vector6d error_;
  Matrix6Xd J_;
  VectorXd step_;
  std::vector<bool> free_;
};

}  // namespace

ChainSolution SolveChain(const SerialChain& chain, const ChainTarget& target, const JointRange& range,
                         const VectorXd& q_start, const VectorXd& q_nominal) {
  ChainSolver solver(chain, target, range, q_start);
  // First with the pull, until the posture settles; a chain that comes no nearer gives up.
  constexpr double kPull = 0.7;
  constexpr double kLeastPull = 0.1;
  constexpr double kSettled = 5e-3;   // rad or m, of the whole pull
  constexpr double kNear = 1e-3;      // m
  constexpr double kFar = 0.03;       // m; less may come from a long way along the pull
  constexpr double kStagnant = 1e-5;  // rad or m
  constexpr double kProgress = 0.98;
  constexpr double kContraction = 0.8;
  constexpr double kSwing = 0.9 * kLargestStep;
  constexpr int kPatience = 10;
  int iteration = 0;
  double best = solver.error();
  int since_best = 0;
  double pull = kPull;
  double last_moved = std::numeric_limits<double>::infinity();
  for (; iteration < target.max_iterations; ++iteration) {
    const double moved = solver.Step(&q_nominal, pull);
    if (solver.error() < kNear && moved < kSettled * pull) break;
    // Across a strongly curved set of solutions a full pull swings to and fro.
    if (moved > kContraction * last_moved && moved < kSwing) pull = std::max(0.5 * pull, kLeastPull);
    last_moved = moved;
    if (moved < kStagnant) break;
    if (solver.error() < kProgress * best) {
      best = solver.error();
      since_best = 0;
    } else if (solver.error() > kFar && ++since_best >= kPatience) {
      break;
    }
  }
  for (; iteration < target.max_iterations + kPatience; ++iteration) {
    if (solver.IsAtTarget()) break;
    if (solver.Step(nullptr, 0.0) < std::numeric_limits<double>::epsilon()) break;
  }
  return solver.Finish();
}

JointRange JointRange::Shrink(double joint_margin) const {
  JointRange shrunk{lower.array() + joint_margin, upper.array() - joint_margin};
  Require((shrunk.lower.array() <= shrunk.upper.array()).all(), "joint_margin",
          "must leave each joint a range", joint_margin);
  return shrunk;
}

double JointRange::CalcMargin(const VectorXd& q) const {
  return std::min((q - lower).minCoeff(), (upper - q).minCoeff());
}

VectorXd JointRange::CalcSpreadPoint(int index) const {
  const Eigen::Index n = lower.size();
  double phi = 2.0;
  constexpr int kIterations = 40;
  for (int i = 0; i < kIterations; ++i) phi = std::pow(1.0 + phi, 1.0 / static_cast<double>(n + 1));
  VectorXd point(n);
  double step = 1.0;
  for (Eigen::Index k = 0; k < n; ++k) {
    step /= phi;
    const double x = 0.5 + step * index;
    point[k] = lower[k] + (x - std::floor(x)) * (upper[k] - lower[k]);
  }
  return point;
}

}  // namespace dexcheck::grasp_internal
