#pragma once

// Faults made on purpose in a run: wrong numbers and equations of the model, wrong laws, wrong plants. The
// campaign counts which of them a run's checks find, and which cause they name.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "harness/injection/drawn_faults.h"
#include "harness/run/runner.h"

namespace dexcheck {

/// Faults to make in a run, and the time for which each is observed.
struct RunMutationOptions {
  /// Time of the scenario at which the fault begins, s. In a motion of joints the fault is there from the
  /// first step, and this is added to `duration`.
  double from = 0.5;
  double duration = 0.1;  ///< Time of observation, s; 0 for a whole motion of joints, 0.1 s of other motions.
  /// Whether a fault that is not found by then is observed up to the end of a motion of joints.
  bool looks_on = false;
  int parameters = 40;  ///< Number of the model's numbers to change, evenly out of all of them.
  double scale = 1e-3;  ///< Size of the change, relative to GetScale.
  bool laws = true;
  bool equations = true;
  bool plants =
      true;  ///< One fault of each kind in plant, motors, sensors and law, its place and size drawn.
  std::vector<std::string> kinds = {};  ///< Kinds of faults to draw from (FaultKind::kind); empty for all.
  /// Number of sets of faults whose places, sizes and times are drawn, in place of all of these; 0 for none.
  int draws = 0;
  int together = 1;  ///< Number of faults in a set.
  std::uint64_t seed = 1;
};

/// Faults that are made at once, and the result of a run with them.
struct RunMutant {
  FaultSet faults;    ///< Each fault by itself.
  InjectedFault all;  ///< All faults together.
  /// Faults that should be named, those that are found where they are alone: the others have no effect.
  std::vector<Fault> truth = {};
  std::vector<CauseOutcome> alone = {};  ///< Naming of each fault where it is alone.

  bool refused = false;  ///< Whether there is no such robot, or the scenario cannot be run with it.
  bool killed = false;   ///< Whether the verdict is not "pass".
  /// Whether the fault is not killed and the motion is the one without the fault: to 1e-12, or for a plant's
  /// fault to the fraction that the balances' bound is. Examples are a push that bearings hold, or a number
  /// without effect on the motion.
  bool no_effect = false;
  Cause cause = Cause::kNone;
  std::string evidence = {};
  NamingScore score = {};          ///< Score of the faults with a size.
  std::string causes = {};         ///< All explanations, in words.
  std::string failure = {};        ///< Why the run ended early; empty when it did not.
  std::string failed_checks = {};  ///< Names, separated by blanks.
  double position_error = 0.0;     ///< Largest position error of the object, m.

  [[nodiscard]] bool has_right_cause() const { return killed && cause == all.cause; }
  /// Whether all of `truth` is named, with its values, and nothing else; for faults without a size, whether
  /// the evidence has their part.
  [[nodiscard]] bool is_named() const;
  /// Whether each of `truth` is named as well as it is alone, and nothing else is.
  [[nodiscard]] bool is_as_alone() const;
};

/// All runs of one scenario. The right robot settles and moves up to options.from once; every fault starts
/// from that state, except faults of the contacts' geometry, which start from the beginning.
class RunCampaign {
 public:
  /// @param scenario must be no task. @throws InputError when it is one; when the scenario without a fault
  /// does not pass, with its cause.
  RunCampaign(const Scenario& scenario, std::filesystem::path robot, std::filesystem::path mjcf,
              const RunMutationOptions& options, const std::function<bool()>& should_stop);

  [[nodiscard]] const std::vector<RunMutant>& mutants() const { return mutants_; }
  /// Time for which each fault is observed, s.
  [[nodiscard]] double duration() const { return options_.duration; }
  /// Makes the fault and observes the run. @param should_stop asked before each step; a stopped run is not
  /// done.
  /// @returns whether it is done.
  bool Run(size_t index, const std::function<bool()>& should_stop);

 private:
  void MakeSetups();
  void ListFaults();
  void MoveToStart(const std::function<bool()>& should_stop);
  void GoToStart(const LoopParts& parts) const;
  /// @param offset by which X_d jumps at the beginning, m and rad.
  [[nodiscard]] Scenario MakeScenario(double from, double duration, double offset) const;
  [[nodiscard]] std::unique_ptr<Setup> MakeSetup(const Scenario& scenario, const RobotModel* model) const;
  bool RunLoop(const Setup& setup, LoopParts parts, RunMutant* mutant, VectorXd* way,
               const std::function<bool()>& should_stop);
  /// @param way gets the change of the engine's positions and rates up to the end. @returns as Run.
  bool RunFault(const InjectedFault& fault, RunMutant* mutant, VectorXd* way,
                const std::function<bool()>& should_stop);
  /// Fills `truth` and `alone`. @returns as Run.
  bool FindTruth(RunMutant* mutant, const std::function<bool()>& should_stop);
  /// @returns why the run without a fault does not pass; empty where it does.
  std::string RunWithoutFault(const std::function<bool()>& should_stop);
  /// Runs the same fault up to the end of the motion. @returns as Run.
  bool LookOn(RunMutant* mutant, const std::function<bool()>& should_stop);

  Scenario scenario_;
  std::filesystem::path robot_, mjcf_;
  RunMutationOptions options_;
  MjModelPtr compiled_;
  double begin_ = 0.0;                   // of the fault in a run, s; 0 where runs continue from `start_`
  std::optional<EngineState> start_;     // of a trajectory; joints begin at their beginning
  std::unique_ptr<Setup> setup_;         // of the right robot, from the start
  std::unique_ptr<Setup> offset_setup_;  // the same with an error that feedback must correct
  VectorXd way_, offset_way_;            // displacement of everything that moves, without a fault
  VectorXd tau_;                         // that they end with, in the first of both
  std::vector<RunMutant> mutants_;
  std::unique_ptr<RunCampaign> whole_;  // for the whole motion
};

}  // namespace dexcheck
