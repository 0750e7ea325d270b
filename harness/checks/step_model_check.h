#pragma once

// The first of the harness's questions at every step of a run: are the controller's terms the engine's?

#include <span>
#include <utility>
#include <vector>

#include "controller/control/grasp_controller.h"
#include "harness/checks/term_comparison.h"

namespace dexcheck {

/// Compares the terms that the controller has evaluated with the engine's at the projected state (no tilt,
/// rolling wheels), and remembers the worst of the run. What random states have beyond this (M unreduced, the
/// matrix C_bar', link inertias) needs no run.
class StepModelCheck : public TermComparison {
 public:
  /// @param fingertips frames of the grasp; none for a robot that holds nothing, all of whose frames are then
  /// compared. @param orientation kAngles when the grasp's state is set by X_o,
  /// whose terms are then compared besides.
  /// @throws InputError as EngineTerms.
  StepModelCheck(const Adapter& adapter, std::span<const int> fingertips, OrientationFeedback orientation);

  /// Whether Compare includes the contacts' terms: not while a fingertip is far from the object.
  void IncludeContacts(bool include) { with_contacts_ = include; }
  /// Takes what is worse in the records of another such check, of the terms that it compares.
  void Merge(const StepModelCheck& other);
  /// There are bonds in the place of contacts, where the engine has nothing to compare with.
  void LeaveOutContacts();

  /// @param robot, grasp evaluated at `state`, reduced coordinates, CalcDynamics included.
  /// @param X_W0 pose of Sigma_0 in the plant, tilt and height included: kappa was found there. Without a
  /// plant, robot.CalcLinkPose(-1).
  /// @param when time of the step, s.
  void Compare(const ModelTerms& robot, const GraspTerms& grasp, const MeasuredState& state, const Pose& X_W0,
               double when);

 private:
  void ReadContacts(const GraspTerms& grasp, const MeasuredState& state, const Pose& X_W0);
  void ReadObject(const GraspTerms& grasp);

  bool has_coordinates_;
  bool with_contacts_ = true;
  bool has_object_;
  EngineTerms engine_;
  std::vector<std::pair<Matrix6Xd, Matrix6Xd>> frame_jacobians_;  // J, J_dot; without fingertips
  VectorXd J_B_dot_xi_;
};

}  // namespace dexcheck
