#pragma once

// Recordings are read more than once: a first reading says what the next one should undo or refine.

#include <functional>
#include <vector>

#include "harness/recordings/judge_recordings.h"
#include "harness/recordings/nonlinear_faults.h"

namespace dexcheck {

/// A cause that holds during all of a recording.
Explanation MakeCause(const Fault& fault);

class Readings {
 public:
  using OnRows = std::function<bool(long rows)>;
  /// Judges the recordings, which are open, by this model, beside faults that were undone.
  using JudgeOnce = std::function<RecordingJudgement(const RobotModel&, const Refinements&, bool has_others,
                                                     const OnRows&)>;

  /// A judgement beside faults that were undone.
  struct Reading {
    RecordingJudgement judgement;
    std::vector<NonlinearFault> faults = {};
  };

  /// All must outlive this.
  Readings(const RobotModel& model, std::vector<Recording>* recordings, const JudgeOptions& options,
           const OnRows& on_rows, JudgeOnce judge);

  /// Returns the judgement that explains the recordings with the fewest numbers.
  RecordingJudgement Run();

 private:
  /// Opens all recordings again and undoes these faults; false where that cannot be.
  bool Reopen(const std::vector<NonlinearFault>& faults);
  RecordingJudgement Judge(const std::vector<NonlinearFault>& faults, const Refinements& refinements);
  /// Decides whether forces follow from velocities at the positions' times.
  void AdvanceVelocities(Reading* reading);
  /// Undoes one nonlinear fault after the other while that explains more.
  /// @param of_model of the geometry; otherwise of the recording.
  void Search(bool of_model, Reading* reading);
  /// Reads again with the refinements of the reading before, until these settle.
  void Refine(Reading* reading);

  const RobotModel& model_;
  std::vector<Recording>* recordings_;
  const JudgeOptions& options_;
  JudgeOnce judge_;
  OnRows count_;
  Refinements refinements_;
  bool goes_on_ = true;
};

}  // namespace dexcheck
