#pragma once

// Laws that are wrong on purpose: does a run find them, and name the part?

#include <memory>
#include <optional>
#include <vector>

#include "controller/control/controller.h"
#include "controller/model/platform.h"
#include "harness/checks/judged_law.h"
#include "harness/diagnosis/equation_faults.h"
#include "harness/diagnosis/law_entries.h"
#include "harness/injection/injected_fault.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// One entry of ListLawEntries, as large as this.
struct LawFault {
  size_t entry = 0;
  double amplitude = 1.0;
  std::optional<LawPlace> place = {};  ///< Torques that alone have it; none for all.
};

/// The entries of the scenario's law, the same list for each setup of a scenario.
struct ScenarioLaw {
  explicit ScenarioLaw(const Setup& setup);
  std::unique_ptr<JudgedLaw> law;
  std::vector<LawEntry> entries;
};

/// A right controller whose torques get what a fault of its law adds to them. The fault is computed from the
/// controller's own terms, and begins with the run: while everything comes to rest the law is right.
class FaultyLaw final : public Controller {
 public:
  /// @param setup of a scenario that is no task; outlives this. @param right the controller of its law.
  /// @param is_on whether the fault is there; empty for from Begin on.
  FaultyLaw(const Setup& setup, std::unique_ptr<Controller> right, LawFault fault, IsOn is_on = {});
  /// The right law, from terms of which one equation is wrong.
  FaultyLaw(const Setup& setup, std::unique_ptr<Controller> right, const EquationFault& fault,
            IsOn is_on = {});

  void Follow(const Trajectory& motion) override { right_->Follow(motion); }
  void Begin(double t, const Reading& reading) override;
  void Step(const Reading& reading, double t, Command* command) override;
  [[nodiscard]] const GraspModel& model() const override { return model_ ? *model_ : right_->model(); }

 private:
  FaultyLaw(const Setup& setup, std::unique_ptr<Controller> right, IsOn is_on);
  /// E_bar' (tau' - tau'_right) (n) at the step of the snapshot; empty where it has none.
  [[nodiscard]] VectorXd CalcChange(const MeasuredState& state);

  std::unique_ptr<Controller> right_;
  IsOn is_on_;
  ScenarioLaw law_;
  ActuationMap actuation_;
  LawTerms terms_;
  StepRecord step_;
  LawSnapshot snapshot_;
  std::optional<LawFault> fault_;
  std::optional<EquationChange> change_;
  std::optional<GraspModel> model_;  // with the changed equation
  bool has_begun_ = false;
};

/// One entry of a ScenarioLaw as a fault of a run. @param place torques that alone have it; none for all.
InjectedFault MakeLawFault(const LawEntry& entry, size_t index, double amplitude,
                           const std::optional<LawPlace>& place);

}  // namespace dexcheck
