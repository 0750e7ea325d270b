#pragma once

// Palm poses at an object that the arm reaches. Internal to controller/grasp.

#include <limits>
#include <vector>

#include "controller/common/types.h"
#include "controller/grasp/contact_plan.h"
#include "controller/grasp/hand_reach.h"
#include "controller/grasp/serial_chain.h"

namespace dexcheck::grasp_internal {

/// A palm pose and the arm posture for it.
struct PalmPose {
  Pose X_BP;
  VectorXd q_arm;
  double arm_margin = 0.0;  // smallest distance of an arm joint from the ends of its range
};

/// How many palm poses failed for which reason.
struct PalmTally {
  int tried = 0;
  int blocked = 0;                                                // palm in the object or below the support
  int missed = 0;                                                 // out of the arm's reach
  int arm_blocked = 0;                                            // arm below the support
  double nearest_miss = std::numeric_limits<double>::infinity();  // m
};

/// Looks for palm poses from which the hand may hold the object. Refers to its arguments.
class PalmSearch {
 public:
  PalmSearch(const RobotModel& model, const Hand& hand, const HandReach& reach, const Surface& object,
             const Pose& X_Bo, const Eigen::Ref<const VectorXd>& q_nominal,
             const ContactPlanOptions& options);

  [[nodiscard]] const SerialChain& arm() const { return arm_; }
  [[nodiscard]] const PalmTally& tally() const { return tally_; }

  /// Palm poses around the object at one distance, those straight down on a support first.
  std::vector<PalmPose> List();

  /// The same palm pose nearer to the object and farther from it.
  std::vector<PalmPose> ListOtherDistances(const PalmPose& pose);

  /// Whether the arm can make all displacements that the options demand.
  [[nodiscard]] bool ReachesBeyond(const PalmPose& pose) const;

 private:
  [[nodiscard]] Pose CalcPalmPose(const Vector3d& direction, double roll) const;
  [[nodiscard]] bool IsPalmClear(const Pose& X_BP) const;
  [[nodiscard]] bool IsArmClear(const VectorXd& q_arm) const;
  [[nodiscard]] ChainSolution SolveArm(const Pose& X_BP, const VectorXd& q_start) const;
  /// Adds the pose with the arm posture that has the largest margin of those found from the starts, if any.
  void Try(const Pose& X_BP, const std::vector<VectorXd>& starts, std::vector<PalmPose>* poses);

  const HandReach& reach_;
  const Surface& object_;
  const ContactPlanOptions& options_;
  Pose X_Bo_;
  SerialChain arm_;
  JointRange range_;  // of the arm, less the margin
  VectorXd nominal_;  // of the arm
  Vector3d p_Po_;     // where the hand holds the object
  PalmTally tally_;
};

}  // namespace dexcheck::grasp_internal
