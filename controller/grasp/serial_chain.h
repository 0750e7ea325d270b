#pragma once

// Kinematics of a few joints between a fixed root and one frame, and their inverse. Internal to
// controller/grasp: for searches that evaluate one chain thousands of times, where the whole robot's terms
// would be wasted.

#include <span>
#include <vector>

#include "controller/common/types.h"
#include "controller/model/robot_model.h"

namespace dexcheck::grasp_internal {

/// For each fingertip the joints that move it and no other one of them, the fingertip's side first.
/// @throws std::invalid_argument when one has none.
std::vector<std::vector<int>> ListOwnJoints(const RobotModel& model, std::span<const int> fingertips);

/// Ranges of joints, rad or m.
struct JointRange {
  VectorXd lower, upper;

  /// The range without a margin at each end. @throws std::invalid_argument when a joint then has none.
  [[nodiscard]] JointRange Shrink(double joint_margin) const;
  /// Smallest distance of an entry of q from the ends of its range; negative outside.
  [[nodiscard]] double CalcMargin(const VectorXd& q) const;
  /// The index-th point (from 1 on) of the additive recurrence x_k = frac(1/2 + index / phi^k), scaled to the
  /// ranges; phi > 1 solves phi^(n+1) = phi + 1 for n coordinates, of which the golden ratio is the case n
  /// = 1.
  [[nodiscard]] VectorXd CalcSpreadPoint(int index) const;
};

/// The chain from the base to a frame with some of its joints free and all others held.
class SerialChain {
 public:
  /// @param joints free ones, each on the chain to `frame`. @param q q', whose other entries are held.
  /// @throws std::invalid_argument when a joint does not move the frame, is named twice, or q has a wrong
  /// size.
  SerialChain(const RobotModel& model, int frame, std::span<const int> joints,
              const Eigen::Ref<const VectorXd>& q);

  /// Free joints, the base's side first; the order of `q` below.
  [[nodiscard]] const std::vector<int>& joints() const { return joints_; }
  [[nodiscard]] Eigen::Index size() const { return static_cast<Eigen::Index>(joints_.size()); }
  [[nodiscard]] const JointRange& range() const { return range_; }

  /// Poses of the frame and of the free joints' links.
  struct Poses {
    std::vector<Pose> links;  ///< One for each free joint.
    Pose frame;
  };
  void CalcPoses(const Eigen::Ref<const VectorXd>& q, Poses* poses) const;

  /// Jacobian (6 x size) of the frame's origin and orientation, [linear; angular], both in the world's axes.
  void CalcJacobian(const Poses& poses, Matrix6Xd* J) const;

  /// Entries of q' that belong to the free joints.
  [[nodiscard]] VectorXd Gather(const Eigen::Ref<const VectorXd>& q) const;
  void Scatter(const Eigen::Ref<const VectorXd>& q_own, Eigen::Ref<VectorXd> q) const;

 private:
  struct Segment {
    Pose before;  // from the link of the free joint before to where this joint turns or slides about z
    bool revolute = true;
    double offset = 0.0;  // added to q
  };

  std::vector<int> joints_;
  std::vector<Segment> segments_;
  Pose after_;  // the frame in the last free joint's link
  int q_offset_;
  JointRange range_;
};

/// Desired pose of a chain's frame.
struct ChainTarget {
  Pose X;                    ///< In the world.
  double length = 0.2;       ///< An error of one radian counts as this many m.
  double tolerance = 1e-13;  ///< m; orientation in rad.
  int max_iterations = 60;
};

struct ChainSolution {
  VectorXd q;             ///< Free joints.
  double position = 0.0;  ///< Residuals: m, rad.
  double orientation = 0.0;
  bool reached = false;
};

/// Damped least squares from `q_start` with joints kept in `range`; what the target leaves free is pulled
/// towards `q_nominal`. Sizes are the chain's.
ChainSolution SolveChain(const SerialChain& chain, const ChainTarget& target, const JointRange& range,
                         const VectorXd& q_start, const VectorXd& q_nominal);

}  // namespace dexcheck::grasp_internal
