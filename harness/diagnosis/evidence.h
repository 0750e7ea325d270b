#pragma once

// What the engine says of the robot at a few random states, kept so that many variants of the analytic model
// can be held against it.

#include <algorithm>
#include <vector>

#include "harness/diagnosis/diagnose.h"
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

}  // namespace dexcheck
