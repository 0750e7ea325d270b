#pragma once

// The category "model" at every step of a run: whether the controller's terms are the engine's.

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "controller/control/trajectory_controller.h"
#include "harness/comparison/term_comparison.h"
#include "harness/descriptions/analytic_provider.h"
#include "harness/descriptions/engine_provider.h"

namespace dexcheck {

/// The terms that a controller has evaluated, as a provider.
class ControllerProvider : public AnalyticProvider {
 public:
  /// @param frames of the grasp, or all of a robot that holds nothing.
  ControllerProvider(const RobotModel& model, std::vector<int> frames, bool contacts, bool has_coordinates);
  /// Nothing allocates.
  void Read(const ModelTerms& robot, const GraspTerms& grasp, const MeasuredState& state);
  using AnalyticProvider::Read;
  void SetState(const DynamicsState&) override {}

 private:
  void ReadContacts(const GraspTerms& grasp, const MeasuredState& state);
  void ReadObject(const GraspTerms& grasp);

  std::optional<ModelView> view_of_terms_;
  std::vector<std::pair<Matrix6Xd, Matrix6Xd>> own_jacobians_;  // J, J_dot; without a grasp
  VectorXd J_B_dot_xi_;
};

/// Compares the terms that the controller has evaluated with the engine's at the projected state (no tilt,
/// rolling wheels), and remembers the worst of the run. Terms that only random states compare (M unreduced,
/// the matrix C_bar', link inertias) need no run.
class StepModelCheck {
 public:
  /// @param fingertips frames of the grasp; none for a robot that holds nothing, all of whose frames are then
  /// compared. @param orientation kAngles when the grasp's state is set by X_o, whose terms are then compared
  /// as well. @throws InputError as EngineTerms.
  StepModelCheck(const Adapter& adapter, std::span<const int> fingertips, OrientationFeedback orientation);

  /// One for each term asked, in the table's order.
  [[nodiscard]] std::span<const CheckRecord> records() const { return comparison_.records(); }
  /// Raises every bound to at least this, the scenario's tolerance.
  void RaiseBounds(double least);
  /// Sets whether Compare includes the contacts' terms: not while a fingertip is far from the object.
  void IncludeContacts(bool include) { with_contacts_ = include; }
  /// Takes over the worse records of another such check, for the terms that it compares.
  void Merge(const StepModelCheck& other);
  /// Leaves out the contacts' terms, where bonds replace contacts and the engine has nothing to compare.
  void LeaveOutContacts();

  /// Evaluates the engine's terms alone, without those of contacts. @param evaluated as
  /// EngineTerms::SetState.
  void SetState(const GraspTerms& grasp, const MeasuredState& state,
                const EvaluatedPositions& evaluated = {});

  /// Compares the terms. Nothing allocates except for the first failure.
  /// @param robot, grasp evaluated at `state`, reduced coordinates, CalcDynamics included.
  /// @param X_W0 pose of Sigma_0 in the plant, tilt and height included, where kappa was found. Without a
  /// plant, robot.CalcLinkPose(-1).
  /// @param when time of the step, s. @param evaluated the plant's positions at this state; null: they are
  /// evaluated here.
  void Compare(const ModelTerms& robot, const GraspTerms& grasp, const MeasuredState& state, const Pose& X_W0,
               double when, const mjData* evaluated = nullptr);

  /// The engine's terms at the last state.
  [[nodiscard]] const EngineProvider& engine() const { return engine_; }

 private:
  /// X_o and its rate of the grasp, where the object's state is known by them.
  [[nodiscard]] std::optional<ObjectCoordinates> FindCoordinates(const GraspTerms& grasp) const;

  bool has_coordinates_;
  bool with_contacts_ = true;
  EngineProvider engine_;
  ControllerProvider controller_;
  TermComparison comparison_;
};

}  // namespace dexcheck
