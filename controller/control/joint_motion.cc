#include "controller/control/joint_motion.h"

#include <algorithm>

#include "controller/common/errors.h"
#include "controller/control/stance.h"

namespace dexcheck {
namespace {

constexpr Eigen::Index kBlock = 6;  // joints of one Trajectory

/// Number of joints in the block that begins at `begin`.
Eigen::Index CountIn(const VectorXd& q, Eigen::Index begin) { return std::min(kBlock, q.size() - begin); }

}  // namespace

JointMotion::JointMotion(const VectorXd& q_start, const std::vector<JointWayPoint>& points,
                         const std::vector<JointOscillation>& oscillations)
    : q_start_(q_start) {
  for (const JointWayPoint& point : points) {
    Require(point.q.size() == q_start.size(), "length of a way point", "must be that of q_start",
            point.q.size());
  }
  for (Eigen::Index begin = 0; !points.empty() && begin < q_start.size(); begin += kBlock) {
    const Eigen::Index count = CountIn(q_start, begin);
    std::vector<WayPoint> displacements;
    for (const JointWayPoint& point : points) {
      WayPoint& to = displacements.emplace_back(WayPoint{point.time, Vector6d::Zero()});
      to.displacement.head(count) = (point.q - q_start).segment(begin, count);
    }
    ways_.push_back(MakeWayPointTrajectory(Vector6d::Zero(), displacements));
  }
  for (const JointOscillation& one : oscillations) {
    Require(one.joint >= 0 && one.joint < q_start.size(), "joint of an oscillation", "must be one",
            one.joint);
    const Vector6d amplitude = one.amplitude * Vector6d::Unit(0);
    oscillations_.emplace_back(
        one.joint,
        MakeOscillationTrajectory(Vector6d::Zero(), amplitude, one.frequency, one.ramp_time, one.end_time));
  }
}

JointMotion::JointMotion(std::shared_ptr<const StanceMotion> stance) : stance_(std::move(stance)) {
  DesiredJoints start;
  stance_->Evaluate(-1.0, &start);
  q_start_ = start.q;
}

void JointMotion::Evaluate(double t, DesiredJoints* desired) const {
  if (stance_) return stance_->Evaluate(t, desired);
  desired->q = q_start_;
  desired->q_dot.setZero(q_start_.size());
  desired->q_ddot.setZero(q_start_.size());
  if (t < 0.0) return;
  for (size_t i = 0; i < ways_.size(); ++i) {
    const Eigen::Index begin = kBlock * static_cast<Eigen::Index>(i);
    const Eigen::Index count = CountIn(q_start_, begin);
    const DesiredMotion way = ways_[i]->Evaluate(t);
    desired->q.segment(begin, count) += way.X_d.head(count);
    desired->q_dot.segment(begin, count) += way.X_d_dot.head(count);
    desired->q_ddot.segment(begin, count) += way.X_d_ddot.head(count);
  }
  for (const auto& [joint, oscillation] : oscillations_) {
    const DesiredMotion swing = oscillation->Evaluate(t);
    desired->q[joint] += swing.X_d[0];
    desired->q_dot[joint] += swing.X_d_dot[0];
    desired->q_ddot[joint] += swing.X_d_ddot[0];
  }
}

}  // namespace dexcheck
