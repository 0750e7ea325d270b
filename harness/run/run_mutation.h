#pragma once

// Faults made on purpose in a run: wrong numbers and equations of the model, wrong laws, wrong plants.
// Which of them do the questions of a run find, and which cause do they name?

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "harness/diagnosis/drawn_faults.h"
#include "harness/diagnosis/faulty_law.h"
#include "harness/diagnosis/parameters.h"
#include "harness/diagnosis/plant_faults.h"
#include "harness/run/run_mutation_options.h"
#include "harness/run/runner.h"

namespace dexcheck {

/// One fault, and what a run with it came to.
struct RunMutant {
  std::string kind;  ///< "law", "motor", "sensor", ...: what a table sums up by.
  std::string name;
  Cause expected = Cause::kNone;
  std::string part;             ///< What the evidence should name; empty for nothing.
  std::vector<Fault> truth;     ///< Of drawn faults that are found alone: how they should be told.
  std::vector<Fault> injected;  ///< The others likewise.

  bool refused = false;  ///< There is no such robot, or the scenario cannot be run with it.
  bool killed = false;   ///< The verdict is not "pass".
  /// Not killed, and what moves is at the end where it is without the fault, to 1e-12: a push that bearings
  /// hold, a number that no motion shows.
  bool no_effect = false;
  Cause cause = Cause::kNone;
  bool names_part = false;  ///< The evidence has `part` in it.
  std::string evidence;
  NamingScore score;            ///< Of drawn faults.
  std::string causes;           ///< All explanations, in words.
  std::string failure;          ///< Why the run ended early; empty when it did not.
  std::string failed_checks;    ///< Names, separated by blanks.
  double position_error = 0.0;  ///< Largest of the object, m.
  bool is_as_expected = true;   ///< Whether the object was where [expect] wants it.

  [[nodiscard]] bool has_right_cause() const { return killed && cause == expected; }
};

/// All runs of one scenario. The right robot settles and moves up to options.from once; every fault starts
/// from the state that it had there, those of the contacts' geometry from the beginning.
class RunCampaign {
 public:
  /// @param scenario that is no task. @throws InputError when it is one; when the scenario without a fault
  /// does not pass, with its cause.
  RunCampaign(const Scenario& scenario, std::filesystem::path robot, std::filesystem::path mjcf,
              const RunMutationOptions& options, const std::function<bool()>& should_stop);

  [[nodiscard]] const std::vector<RunMutant>& mutants() const { return mutants_; }
  /// Makes the fault and looks what comes of it. @param should_stop asked before each step; what was
  /// stopped is not done.
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
  /// @param end gets the engine's positions and rates at the end.
  bool RunLoop(const Setup& setup, LoopParts parts, RunMutant* mutant, VectorXd* end,
               const std::function<bool()>& should_stop);
  bool RunPlant(const PlantFault& fault, RunMutant* mutant, VectorXd* end,
                const std::function<bool()>& should_stop);
  /// Of a drawn set's truth keeps what is found where it is alone: the rest has no effect. @returns as Run.
  bool KeepFound(const std::vector<PlantFault>& each, RunMutant* mutant,
                 const std::function<bool()>& should_stop);
  /// Of the fault with this index. @returns as Run.
  bool RunFault(size_t index, VectorXd* end, const std::function<bool()>& should_stop);
  [[nodiscard]] bool IsLaw(size_t index) const {
    return index >= parameters_.size() && index < parameters_.size() + laws_.size();
  }
  void RequireNoFaultToPass(const std::function<bool()>& should_stop);

  Scenario scenario_;
  std::filesystem::path robot_, mjcf_;
  RunMutationOptions options_;
  MjModelPtr compiled_;
  std::optional<EngineState> start_;   // of a trajectory; joints begin at their beginning
  std::unique_ptr<Setup> setup_;       // of the right robot, from the start
  std::unique_ptr<Setup> offsetd_;     // the same with an error that feedback has to answer
  VectorXd end_, offsetd_end_;         // where they come to without a fault
  VectorXd tau_;                       // that they end with, in the first of both
  std::vector<Parameter> parameters_;  // by mutant, those of numbers first
  std::vector<LawFault> laws_;
  std::vector<EquationFault> equations_;
  std::vector<PlantFault> plants_;
  std::vector<std::vector<PlantFault>> singles_;  // of drawn sets, each alone
  std::vector<RunMutant> mutants_;
};

}  // namespace dexcheck
