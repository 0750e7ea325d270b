#pragma once

// Where the analytic model has its axes, frames and bodies against where the engine has them, and what
// changes when single numbers of the geometry change.

#include <vector>

#include "harness/diagnosis/evidence.h"
#include "harness/diagnosis/file_terms.h"
#include "harness/diagnosis/parameters.h"

namespace dexcheck {

/// Something that both sides place in the world.
struct PlacedItem {
  enum class Kind { kAxisDirection, kAxisLine, kFramePosition, kFrameRotation, kCom, kInertia };
  Kind kind;
  int index;  ///< Joint, frame or link (by its joint).
  int link;   ///< The link that it stands on, by its joint; -1 the base.

  [[nodiscard]] bool IsAxis() const { return kind <= Kind::kAxisLine; }
  [[nodiscard]] bool IsBody() const { return kind >= Kind::kCom; }
};

/// A trial model whose geometry can be changed number by number; only what hangs on a change is computed
/// again.
class Placement {
 public:
  /// @param written numbers as they stand in the file. @param terms, evidence must outlive this.
  /// @param bodies whether centres of mass and inertias are compared besides axes and frames.
  Placement(const RobotSpec& written, const FileTerms& terms, const EngineEvidence& evidence, bool bodies);

  [[nodiscard]] const std::vector<PlacedItem>& items() const { return items_; }
  [[nodiscard]] const RobotSpec& trial() const { return trial_; }
  /// Of a link's frame of the file at the first sample, world.
  [[nodiscard]] const Pose& PoseOf(int link) const { return poses_[0][static_cast<size_t>(link + 1)]; }
  /// Whether link `inner` carries `outer` or is it; -1 carries all.
  [[nodiscard]] bool Carries(int inner, int outer) const;

  /// Changes a number of the trial.
  void Set(const Parameter& parameter, double value);
  /// Replaces the whole trial; the tree must be the same.
  void Replace(const RobotSpec& spec);

  /// Differences of items over all samples, engine minus trial: lengths by the robot's, inertias by their
  /// trace, directions as they are. All zero when both agree.
  [[nodiscard]] VectorXd CalcResidual(const std::vector<int>& items) const;
  /// Whether the largest of an item's is more than rounding, or the evidence's tolerance, leaves.
  [[nodiscard]] bool Fails(int item) const;
  /// How many numbers of the model would have to change to put it right by itself: components in the link's
  /// frame of what a body has wrong, three for an axis or a frame, none for what is right.
  [[nodiscard]] int CountWrongNumbers(int item) const;
  /// Whether a link stands where the engine has it: its axis, its ancestors' axes, and all frames and axes
  /// that it carries.
  [[nodiscard]] bool IsPlaced(int link) const;

 private:
  using Difference = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, 3>;
  [[nodiscard]] Difference CalcDifference(const PlacedItem& item, size_t sample) const;
  /// Poses of what a joint carries; -1: all.
  void UpdateFrom(int joint);
  [[nodiscard]] Pose CalcBasePose(const VectorXd& q) const;

  RobotSpec trial_;
  Vector3d base_origin_;
  const FileTerms* terms_;
  const EngineEvidence* evidence_;
  std::vector<PlacedItem> items_;
  std::vector<std::vector<Pose>> poses_;  // of the links' frames of the file, by sample, base first
};

/// Joint whose motion carries what the parameter places: its own, or -1 when that is everything.
int CarrierOf(const RobotSpec& spec, const Parameter& parameter);

}  // namespace dexcheck
