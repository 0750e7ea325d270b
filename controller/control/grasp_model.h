#pragma once

// Everything that the paper's laws need of robot, object and contacts at one state.

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "controller/common/types.h"
#include "controller/control/grasp_terms.h"
#include "controller/control/object_tracking.h"
#include "controller/control/reading.h"
#include "controller/dynamics/model_terms.h"

namespace dexcheck {

struct GraspModelOptions {
  /// kAngles evaluates the object's terms in X_o besides, on one branch of the angles.
  OrientationFeedback orientation = OrientationFeedback::kAngles;
  Vector6d X_o_start = Vector6d::Zero();  ///< The angles' branch is the one nearest to this at first.
  std::vector<Bond> bonds;                ///< None, or one for each fingertip.
};

/// M_bar', C_bar', F_bar', G, J_B' and their rates, all at one state. Nothing allocates after construction.
class GraspModel {
 public:
  /// @param fingertips frames that hold the object. @param object, surface in Sigma_o; surface outlives this.
  /// @throws as GraspTerms.
  GraspModel(const RobotModel& model, std::span<const int> fingertips, const MassProperties& object,
             const Surface& surface, const GraspModelOptions& options);

  /// Evaluates all terms at a state. @throws what GraspTerms and CalcP throw.
  void SetState(const MeasuredState& state);

  /// The angles' branch is the one nearest to that of `other` at the next state.
  void Follow(const GraspModel& other) { X_o_ = other.X_o_; }

  [[nodiscard]] const ModelTerms& robot() const { return robot_; }
  [[nodiscard]] const GraspTerms& grasp() const { return grasp_; }
  /// Whether X_o and the terms in it are evaluated.
  [[nodiscard]] bool has_coordinates() const { return orientation_ == OrientationFeedback::kAngles; }

 private:
  OrientationFeedback orientation_;
  ModelTerms robot_;
  GraspTerms grasp_;
  Vector6d X_o_;  // of the last state, to stay on one branch of the angles
};

/// Two of them by turns: what was evaluated at one step can be read while the next one is evaluated.
class AlternatingModel {
 public:
  explicit AlternatingModel(const GraspModel& model) : models_{model, model} {}

  /// Sets the state as GraspModel::SetState does; the model of the previous call is kept unchanged.
  void SetState(const MeasuredState& state) {
    const GraspModel& last = now();
    now_ = 1 - now_;
    models_[now_].Follow(last);
    models_[now_].SetState(state);
  }
  /// The one that was evaluated last.
  [[nodiscard]] const GraspModel& now() const { return models_[now_]; }

 private:
  std::array<GraspModel, 2> models_;
  size_t now_ = 0;
};

}  // namespace dexcheck
