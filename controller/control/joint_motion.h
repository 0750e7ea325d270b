#pragma once

// Desired joint motion of a robot that holds nothing: q_d(t), with its first two derivatives.

#include <memory>
#include <utility>
#include <vector>

#include "controller/common/types.h"
#include "controller/control/trajectory.h"

namespace dexcheck {

/// q_d and its derivatives at one instant, by joint: rad or m, and per s.
struct DesiredJoints {
  VectorXd q, q_dot, q_ddot;
};

/// A joint is somewhere at a time.
struct JointWayPoint {
  double time = 0.0;  ///< s, > 0.
  VectorXd q;         ///< All joints, rad or m.
};

/// A joint swings: amplitude sin(2 pi frequency t), which grows with least jerk over ramp_time,
/// and ends so at end_time.
struct JointOscillation {
  int joint = 0;
  double amplitude = 0.0;  ///< rad or m.
  double frequency = 0.0;  ///< 1/s.
  double ramp_time = 0.0;  ///< s.
  double end_time = 0.0;   ///< s; 0 for never.
};

class StanceMotion;

/// q_d(t) of all joints: from where they start through way points, as MakeWayPointTrajectory goes, with
/// oscillations on top. Before t = 0 it is at rest at the start. Evaluation does not allocate once the result
/// has its sizes.
class JointMotion {
 public:
  /// @param q_start of all joints. @param points none to stay at the start.
  /// @throws std::invalid_argument when a size differs, and as MakeWayPointTrajectory,
  /// MakeOscillationTrajectory.
  JointMotion(const VectorXd& q_start, const std::vector<JointWayPoint>& points,
              const std::vector<JointOscillation>& oscillations);

  /// Takes all of q_d from a stance motion of a legged robot; q' and xi include those of the base.
  explicit JointMotion(std::shared_ptr<const StanceMotion> stance);

  [[nodiscard]] const VectorXd& q_start() const { return q_start_; }
  void Evaluate(double t, DesiredJoints* desired) const;

 private:
  std::shared_ptr<const StanceMotion> stance_;  // null for a base that is fixed
  VectorXd q_start_;
  /// Displacements of six joints each; of the last, only as many as there are.
  std::vector<std::unique_ptr<Trajectory>> ways_;
  std::vector<std::pair<int, std::unique_ptr<Trajectory>>> oscillations_;  // by joint, in the first entry
};

}  // namespace dexcheck
