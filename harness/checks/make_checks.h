#pragma once

// Which checks a run has: nothing else asks what kind of run it is.

#include <memory>
#include <vector>

#include "harness/checks/check_table.h"
#include "harness/checks/judged_law.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// A check of one run.
struct Judge {
  const CheckInfo* info = nullptr;
  std::unique_ptr<StatefulJudge> state;  ///< Null for a check without a memory.
  CheckRecord record;                    ///< Without what came of it.

  [[nodiscard]] Evaluation Evaluate(const StepAnalysis& step) const {
    return state ? state->Evaluate(step) : info->by.evaluate(step);
  }
};

/// The law of a run; null for a task, or where it is not known. @param knows_law whether the controller's law
/// is the scenario's.
std::unique_ptr<JudgedLaw> MakeJudgedLaw(const Setup& setup, bool knows_law);

/// The checks of a run, in the order of log and summary, each with its bound. @param law of MakeJudgedLaw.
/// @throws InputError when a bound of the scenario has the name of no check.
std::vector<Judge> MakeChecks(const Setup& setup, const JudgedLaw* law);

}  // namespace dexcheck
