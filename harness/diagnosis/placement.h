#pragma once

// Where the analytic model has its axes, frames and bodies against where the engine has them, and what
// changes when single numbers of the geometry change.

#include <span>
#include <vector>

#include "harness/diagnosis/evidence.h"
#include "harness/diagnosis/parameters.h"

namespace dexcheck {

/// Something that both sides place in the world.
struct PlacedItem {
  enum class Kind { kAxisDirection, kAxisLine, kFramePosition, kFrameRotation, kCom, kInertia };
  Kind kind;
  int index;  ///< Joint, frame or link (by its joint).
  int link;   ///< The link that it stands on, by its joint; -1 the base.
};

/// A trial model whose geometry can be changed number by number; only what hangs on a change is computed
/// again.
class Placement {
 public:
  /// @param evidence must outlive this.
  /// @param bodies whether centres of mass and inertias are compared besides axes and frames.
  Placement(const RobotSpec& spec, const EngineEvidence& evidence, bool bodies);

  [[nodiscard]] const std::vector<PlacedItem>& items() const { return items_; }
  [[nodiscard]] const RobotSpec& trial() const { return trial_; }
  [[nodiscard]] const EngineEvidence& evidence() const { return *evidence_; }
  /// Size of the robot, m.
  [[nodiscard]] double length() const { return evidence_->length(); }
  /// Items on links that move with a joint, by index in items(); -1: all.
  [[nodiscard]] const std::vector<int>& ItemsBeyond(int joint) const {
    return beyond_[static_cast<size_t>(joint + 1)];
  }
  /// Whether link `inner` carries `outer` or is it.
  [[nodiscard]] bool Carries(int inner, int outer) const;

  /// Changes a number of the trial.
  void Set(const Parameter& parameter, double value);
  /// Replaces the whole trial; the tree must be the same.
  void Replace(const RobotSpec& spec);
  /// From now on changes are followed only as far as these items need them.
  void Focus(const std::vector<int>& items);
  /// From now on they are followed wholly; what was left out until now comes with Follow, or with Restore of
  /// what was changed.
  void Unfocus();
  void Follow();
  /// Puts the geometry of one joint and of all frames back to that of `spec` (-1: the base's place).
  void Restore(const RobotSpec& spec, const Parameter& parameter);

  /// The item's differences over all samples, engine minus trial: lengths by the robot's, inertias by their
  /// trace, directions as they are. All zero when both agree.
  void AppendResidual(int item, std::vector<double>* rows) const;
  /// Whether the largest of them is more than rounding, or the evidence's tolerance, leaves.
  [[nodiscard]] bool Fails(int item) const;
  /// How many numbers of the model would have to change to put it right by itself: components in the link's
  /// frame of what a body has wrong, three for an axis or a frame, none for what is right.
  [[nodiscard]] int CountWrongNumbers(int item) const;
  /// Largest residual of an item.
  [[nodiscard]] double CalcError(int item) const;

 private:
  /// The joint's own transforms.
  void UpdateRow(int joint);
  /// Poses of what a joint carries; -1: all.
  void UpdateFrom(int joint);
  void UpdateAll();
  [[nodiscard]] Pose CalcBasePose(const VectorXd& q) const;

  RobotSpec trial_;
  Vector3d base_origin_;
  const EngineEvidence* evidence_;
  size_t used_;  // samples
  std::vector<PlacedItem> items_;
  std::vector<std::vector<int>> beyond_;
  std::vector<std::vector<int>> subtree_;  // joints that move with a joint, itself first; base first
  std::vector<std::vector<Pose>> rows_;    // from parent to link, by sample; the base's is not used
  std::vector<std::vector<Pose>> poses_;   // by sample, base first
  std::vector<bool> focus_;                // links whose poses are followed, base first; empty: all
  mutable std::vector<double> scratch_;
};

/// Joint whose motion carries what the parameter places: its own, or -1 when that is everything.
int CarrierOf(const RobotSpec& spec, const Parameter& parameter);

}  // namespace dexcheck
