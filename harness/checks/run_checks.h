#pragma once

// The checks that a run has: nothing else depends on the kind of run.

#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "harness/checks/check_table.h"
#include "harness/checks/declared_plant.h"
#include "harness/checks/judged_law.h"
#include "harness/checks/step_analysis.h"
#include "harness/checks/step_model_check.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// A check of one run.
struct Judge {
  const CheckInfo* info = nullptr;
  std::unique_ptr<StatefulJudge> state;  ///< Null for a check without a memory.
  CheckRecord record;                    ///< Name and bound; its results stand in RunChecks.

  [[nodiscard]] Evaluation Evaluate(const StepAnalysis& step) const {
    return state ? state->Evaluate(step) : info->by.evaluate(step);
  }
};

/// The law of a run; null for a task or an unknown law. @param knows_law whether it is the scenario's.
std::unique_ptr<JudgedLaw> MakeJudgedLaw(const Setup& setup, bool knows_law);

/// The checks of a run, in the order of log and summary, each with its bound. @param law of MakeJudgedLaw.
/// @throws InputError when a bound of the scenario has the name of no check.
std::vector<Judge> MakeChecks(const Setup& setup, const JudgedLaw* law);

// All checks of a run, at every step.

/// Facts beside the checks that explain why one failed.
struct CheckContext {
  /// Largest errors of the object that (57) by itself would leave while expectations apply, m and rad; below
  /// zero where it is not integrated.
  double position_by_law = -1.0, orientation_by_law = -1.0;
  bool is_ideal = true;  ///< The scenario declares no imperfection of the plant.
  /// `actuator_effort` where the scenario lets torques be cut off: no fault, but a possible cause of others.
  std::optional<CheckRecord> limited;
};

/// The checks of one run, with their worst values. Each step is followed first, and judged then. Nothing
/// allocates in a step, except in StepAnalyzer and where a check of the model fails for the first time.
class RunChecks {
 public:
  /// @param motors of the plant. @param knows_law whether the controller's law is the scenario's; otherwise
  /// no check of the law is made.
  /// @throws InputError as EngineTerms and MakeChecks.
  RunChecks(const Setup& setup, std::span<const Motor> motors, bool knows_law = true);

  /// Follows the scenario's declarations for the step, whose command is set: once at each step, before it is
  /// judged, also for steps that are not judged.
  void Follow(const StepRecord& step);
  /// JudgedLaw::Follow.
  void FollowMotion(const Trajectory* motion, double begin) {
    if (law_) law_->Follow(motion, begin);
  }
  /// Moves robot and object by `way` (m, world) from now on.
  void Translate(const Vector3d& way) { declared_.Translate(way); }
  /// Adds `v` (m/s, world) to the velocity of robot and object from now on.
  void AddVelocity(const Vector3d& v) { declared_.AddVelocity(v); }

  /// Judges the effort before a step that the motors may refuse. @param time of the step, s.
  void JudgeEffort(const StepRecord& step, double time);
  /// Judges a step while everything settles.
  void JudgeSettling(const StepRecord& step);
  /// Compares the terms that the controller used with the engine's.
  void JudgeModel(const StepRecord& step);
  /// Judges everything else, after JudgeModel.
  void JudgeStep(const StepRecord& step);
  /// Judges model and torques alone, where torques were not sent because they are above a motor's limit.
  void JudgeUnsent(const StepRecord& step);
  /// Checks that failed and are kept: all; those that hold at every step, while contacts find their places.
  enum class Keep { kAll, kHoldsAlways };
  /// Forgets motion and forces of all steps so far, but for such checks that failed: time begins anew.
  void Reset(Keep keep);

  [[nodiscard]] std::span<const CheckRecord> model_checks() const { return model_.records(); }
  [[nodiscard]] std::span<const CheckRecord> motion_checks() const { return records_; }
  /// Whether the run has a check of the motion of that name.
  [[nodiscard]] bool Has(std::string_view name) const;
  /// That check. @throws std::invalid_argument when the run has none.
  [[nodiscard]] const CheckRecord& Find(std::string_view name) const;
  /// Checks of the motion that failed before the last Reset, while everything settled, in that order.
  [[nodiscard]] std::span<const CheckRecord> settling_failures() const { return settling_failures_; }
  [[nodiscard]] CheckContext context() const {
    return {position_by_law_, orientation_by_law_, declared_.is_ideal(), limited_};
  }
  /// Whether a check of the motion failed at the last step.
  [[nodiscard]] bool differs() const { return differs_; }
  /// The law that torques are compared with; null where none is known.
  [[nodiscard]] JudgedLaw* law() const { return law_.get(); }
  /// Analysis of the last step.
  [[nodiscard]] const StepAnalysis& analysis() const { return analyzer_.analysis(); }
  /// Distances of the bodies that must not touch.
  [[nodiscard]] const Clearance& clearance() const { return analyzer_.clearance(); }

 private:
  void CheckMeasuredState();
  /// Begins the analysis of a step, whose torques are set.
  void Look(const StepRecord& step);
  void Analyze(const StepRecord& step);
  /// Evaluates the checks of that moment.
  void Evaluate(CheckInfo::Moment moment, double time);
  void Add(const Judge& judge, CheckRecord* record, double time);
  /// Compares the torques of a step of settling with the law's. @return whether there is a law.
  bool CompareTorque(const StepRecord& step);
  /// Returns the law's terms by the engine at the measured state. @param contacts whether these are its, too.
  const LawTerms& ReadLawTerms(const StepRecord& step, bool contacts);
  void CompareLaw(const StepRecord& step);

  const Setup* setup_;
  StepModelCheck model_;
  /// Compares the controller's terms at the measured state, by an engine without the scenario's mismatch,
  /// where the measured state is not the true one.
  std::optional<StepModelCheck> controller_;
  DeclaredPlant declared_;
  const DeclaredStep* declared_step_ = nullptr;  // of the step
  StepAnalyzer analyzer_;
  std::unique_ptr<JudgedLaw> law_;  // null where none is known
  LawTerms law_terms_;
  LawErrors unsent_;
  std::vector<Judge> judges_;
  std::vector<CheckRecord> records_;  // of judges_
  std::vector<CheckRecord> settling_failures_;
  std::optional<CheckRecord> limited_;                         // of torques that the scenario lets be cut off
  double position_by_law_ = -1.0, orientation_by_law_ = -1.0;  // largest; see CheckContext
  bool differs_ = false;
};

}  // namespace dexcheck
