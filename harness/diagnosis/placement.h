#pragma once

// What the engine says of the robot at a few random states, kept so that many variants of the analytic model
// can be held against it: their forces, and where they have axes, frames and bodies.

#include <algorithm>
#include <vector>

#include "harness/diagnosis/diagnose.h"
#include "harness/diagnosis/file_terms.h"
#include "harness/diagnosis/parameters.h"
#include "harness/engine/engine_terms.h"

namespace dexcheck {

/// The engine's robot at one state. Vectors of links begin with the base's.
struct StateSample {
  VectorXd q;
  VectorXd xi;
  MatrixXd probes;                ///< Two accelerations, n x 2, of a size that moves each coordinate alike.
  std::vector<Vector3d> axes;     ///< Direction of each joint's axis, world.
  std::vector<Vector3d> anchors;  ///< A point on it, m, world.
  std::vector<Pose> frames;       ///< Of each named frame, world.
  std::vector<LinkInWorld> links;
};

/// StateSamples at random states, and the analytic model's forces in the same order and scale.
class EngineEvidence {
 public:
  EngineEvidence(const Adapter& adapter, const DiagnosisOptions& options);

  [[nodiscard]] const std::vector<StateSample>& samples() const { return samples_; }
  /// Largest distance of a point of the robot from its base, m.
  [[nodiscard]] double length() const { return length_; }

  /// What a relative difference may be: what rounding leaves, or the tolerance when that is wider.
  [[nodiscard]] double Widen(double rounding) const { return std::max(rounding, tolerance_); }
  /// What solving for a number beside others that are rounded leaves open, relative: a tenth of the
  /// tolerance, so that the number stays within it when it is rounded so.
  [[nodiscard]] double CalcSolvedDigits() const { return 0.1 * tolerance_; }

  /// Forces that a variant of the model needs at the states: for each, M times the probes, C xi, gravity,
  /// friction. Each is divided by the root of the engine's M_ii and by the block's size, friction by the
  /// joint's own: of order 1 for finger and platform alike.
  [[nodiscard]] VectorXd CalcForces(const RobotModel& variant) const {
    return (CalcRawForces(variant).array() * scale_.array()).reshaped();
  }
  /// The engine's forces in the same scale minus the variant's.
  [[nodiscard]] VectorXd CalcForceResidual(const RobotModel& variant) const {
    return engine_forces_ - CalcForces(variant);
  }

 private:
  /// By coordinate, block after block; a column for each sample.
  [[nodiscard]] MatrixXd CalcRawForces(const RobotModel& variant) const;
  /// @param roots of the engine's M_ii; a column for each sample.
  void CalcScales(const RobotModel& model, const MatrixXd& roots, const MatrixXd& engine_forces);

  std::vector<StateSample> samples_;
  VectorXd engine_forces_;  // scaled
  MatrixXd scale_;          // what CalcRawForces is multiplied by
  double length_ = 0.0;
  double tolerance_ = 0.0;
};

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
  Placement(const RobotSpec& written, const FileTerms& terms, const EngineEvidence& evidence);

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
