#pragma once

#include <mujoco/mujoco.h>

#include <vector>

#include "renders/decoration.h"
#include "renders/overlay.h"
#include "renders/run_frames.h"

namespace dexcheck {

struct DecorationOptions {
  bool forces = false;
  bool tracks = false;
};

/// Makes what is drawn into the scene of a run: forces, tracks, paths.
class RunDecorator {
 public:
  /// @param data scratch for kinematics.
  RunDecorator(const mjModel& model, const RunFrames& run, const DecorationOptions& options, mjData* data);

  /// @param data the state of `row`, kinematics computed.
  std::vector<Decoration> Make(long row, const mjData& data) const;

  /// The key to the colours.
  [[nodiscard]] std::vector<LegendEntry> MakeLegend() const;

 private:
  void AddTracks(long row, const Pose& X_WO, std::vector<Decoration>* decorations) const;
  void AddPaths(long row, const Vector3d& p_WO, std::vector<Decoration>* decorations) const;

  const RunFrames& run_;
  DecorationOptions options_;
  int object_ = -1;  // body
  double meters_per_newton_;
  std::vector<long> sampled_;  // rows, evenly spread
  std::vector<Pose> poses_;    // X_WO at the sampled rows
};

/// How long the arrow of 1 N is drawn: the run's largest contact force fits beside a hand. 1 when there is
/// none.
double CalcMetersPerNewton(const RunFrames& run);

/// The pose of a body in computed kinematics.
Pose BodyPose(const mjData& data, int body);

/// Puts a row of a run into `data` and computes what drawing needs.
void SetRow(const mjModel& model, const RunFrames& run, long row, mjData* data);

}  // namespace dexcheck
