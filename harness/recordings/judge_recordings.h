#pragma once

// Whether a model explains what a robot did, and if not, what is missing.

#include <functional>
#include <string>
#include <vector>

#include "harness/recordings/cause_description.h"
#include "harness/recordings/read_recordings.h"
#include "harness/recordings/torque_estimator.h"

namespace dexcheck {

/// Root mean squares over a recording, of one joint, in N m or N.
struct JointJudgement {
  int recording = 0;
  int joint = -1;
  double samples = 0.0;
  double torque = 0.0;                          ///< Measured.
  double modelled = 0.0;                        ///< The model's.
  double residual = 0.0;                        ///< Measured less the model's.
  double left = 0.0;                            ///< Of that, beyond the causes.
  double noise = 0.0;                           ///< What noise and derivatives make of it.
  double hidden = 0.0;                          ///< Error of the model's torque that noise may hide.
  double held_residual = 0.0, held_left = 0.0;  ///< The same in the quarter that no cause was found with.
  double drive_gain = 0.0;                      ///< N m/A, where currents were recorded; otherwise 0.

  /// Whether noise may hide an error of a fifth of the model's torque.
  [[nodiscard]] bool IsHidden() const { return hidden >= 0.2 * modelled; }
};

/// Means over a block of time, for pictures. By judged joint.
struct TorqueTrace {
  int recording = 0;
  double time = 0.0;  ///< s
  VectorXd q;         ///< All joints.
  VectorXd measured, modelled, explained, left;
};

struct RecordingJudgement {
  std::vector<int> joints;              ///< That were judged.
  std::vector<UnjudgedJoint> unjudged;  ///< Joints with a position that were not.
  std::vector<JointJudgement> balances;
  Causes causes;
  std::vector<FoundFault> found;  ///< The same.
  double explained = 0.0;         ///< Fraction of the residual, squared.
  double left = 0.0;              ///< Root mean square of the rest, in units of noise.
  /// By the causes; by a plain least-squares fit of all bodies' numbers that the motion determines, friction,
  /// offsets and armatures.
  HeldPrediction by_causes, by_all;
  long undone = 0;          ///< Numbers of faults that were undone before the causes were sought.
  bool has_pushes = false;  ///< Some cause begins or ends, in what was held out at an unknown time.
  std::vector<TorqueTrace> traces;
  std::vector<std::string> notes;
  long rows = 0;
  bool rests = false;            ///< No joint moves: only gravity at one posture shows.
  bool has_other_times = false;  ///< Velocities were recorded at other times than positions.
  Refinements refinements;       ///< With which a further reading would find more.

  /// Causes that are more than the nearest that is known.
  [[nodiscard]] size_t CountExplaining() const;
  /// Beside the causes no more than noise is left, in the quarter that was held out as well but for the begin
  /// and end of pushes.
  [[nodiscard]] bool IsNoise() const;
  /// A fit of all numbers predicts the quarter that was held out better than the causes do.
  [[nodiscard]] bool IsBeaten() const { return by_causes.IsBeatenBy(by_all, by_causes.numbers + undone > 0); }
  /// The causes explain all that is to be explained.
  [[nodiscard]] bool IsWhole() const { return IsNoise() && !IsBeaten(); }
  /// Noise may hide such errors at every joint.
  [[nodiscard]] bool IsHidden() const;
  /// Joints move, all that do are judged, and the residual is noise, with no cause, beside which errors of
  /// every joint show.
  [[nodiscard]] bool Agrees() const;
};

struct JudgeOptions : ReadOptions {
  size_t most_causes = 16;
  bool tries_positions = true;  ///< Other signs, units and orders of positions, where little is explained.
};

/// @param recordings of one robot; each is read once.
/// @param on_rows called with the number of rows so far; ends the reading by returning false.
/// @throws InputError, one line, for data that cannot be understood.
RecordingJudgement JudgeRecordings(const RobotModel& model, std::vector<Recording>* recordings,
                                   const JudgeOptions& options,
                                   const std::function<bool(long rows)>& on_rows = {});

}  // namespace dexcheck
