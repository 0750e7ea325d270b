#pragma once

// What a file says of a robot, beside what stands in its place where the file says nothing.

#include <optional>
#include <string>
#include <vector>

#include "controller/model/robot_model.h"

namespace dexcheck {

/// A joint that follows another one: q_i = multiplier q_leader + offset (rad or m).
struct JointCoupling {
  int leader = -1;  ///< Index of the joint that is followed, which follows none itself.
  double multiplier = 1.0;
  double offset = 0.0;  ///< rad or m
};

/// What a file says of a joint and its link, beside the specification.
struct DescribedJoint {
  // Which constants the file states. What it does not state is zero in the specification, or a range of +-pi.
  bool states_range = true;
  bool states_damping = true;
  bool states_dry_friction = true;
  bool states_armature = true;

  double dry_friction =
      0.0;  ///< Coulomb friction, N m or N: the force of a sliding joint, -this sign(q_i_dot).
  std::optional<JointCoupling> coupling;
  /// The link's own frame L, in which its file gives masses and what hangs on it, in frame i.
  Pose X_iL = Pose::Identity();
};

/// A robot as one file describes it.
struct RobotDescription {
  RobotSpec spec;
  std::vector<DescribedJoint> joints;  ///< By joint.
  bool states_gravity = true;
  std::vector<std::string> notes;  ///< What was done with the file that its reader may not expect.
};

/// T with xi = T xi_free, size joints x (joints - coupled joints): the rates that the couplings leave free. T
/// is constant, so T^T M T, T^T C T, T^T F are the terms of the coupled robot.
MatrixXd CalcCouplingMap(const RobotDescription& robot);

}  // namespace dexcheck
