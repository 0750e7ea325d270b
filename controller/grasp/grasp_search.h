#pragma once

// Palm poses at an object that the arm reaches. Internal to controller/grasp.

#include <limits>
#include <optional>
#include <vector>

#include "controller/common/types.h"
#include "controller/grasp/contact_plan.h"
#include "controller/grasp/force_closure.h"
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

// Which of the touches that each finger can make hold an object best. Internal to controller/grasp.

/// One touch for each finger, as indices into the fingers' lists.
struct TouchChoice {
  std::vector<size_t> indices;
  double bound = 0.0;  ///< Upper bound on the margin of force closure, over the directions known so far.
  double score = 0.0;  ///< TouchScore of the bound and the smallest joint margin.
};

/// What a grasp is worth: its margin of force closure, and less of it the nearer a joint is to the end of its
/// range; half at `comfort`.
struct TouchScore {
  double comfort = 0.0;  ///< rad or m; 0 counts the margin alone.

  [[nodiscard]] double Calc(double margin, double joint_margin) const {
    return margin <= 0.0 || comfort <= 0.0 ? margin : margin * joint_margin / (joint_margin + comfort);
  }
};

/// Chooses touches by the margin of force closure. The margin is the least support of the set of wrenches
/// over all directions; over some directions it is an upper bound that costs a few comparisons. Directions
/// that exact margins turn out to be weak in are added, so that the bound becomes sharp where it matters.
class TouchChooser {
 public:
  /// @param mu friction. @param length m; a moment counts as the force moment / length.
  TouchChooser(const HandReach& hand, double mu, double length, TouchScore score);

  /// Fills in `supports` of touches, for the directions known now.
  void SetSupports(std::vector<Touch>* touches) const;

  /// The best choice, by score, of fingers that stay apart that coordinate ascent finds from `num_starts`
  /// choices spread over the lists, the first of which is that of all lists' first entries; nothing when a
  /// list is empty or no fingers stay apart. Supports must be set.
  /// @param arm_margin smallest joint margin of the arm that carries the fingers.
  [[nodiscard]] std::optional<TouchChoice> Choose(const std::vector<std::vector<Touch>>& touches,
                                                  const HandClearance& clearance, double arm_margin,
                                                  int num_starts) const;

  /// Margin of force closure of these touches, one for each finger. Its weakest direction is added to the
  /// known.
  ForceClosureResult Measure(const std::vector<const Touch*>& touches);

 private:
  [[nodiscard]] VectorXd CalcSupports(const Touch& touch) const;

  const HandReach& hand_;
  double mu_;
  double length_;
  TouchScore score_;
  std::vector<Vector6d> directions_;  // functionals on [force; moment / length]
};

}  // namespace dexcheck::grasp_internal
