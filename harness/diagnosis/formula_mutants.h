#pragma once

// Wrong equations (equation_faults.h), which no parameter can express: put in the checks' way in place of the
// model's.

#include <vector>

#include "harness/diagnosis/equation_faults.h"
#include "harness/diagnosis/mutation.h"
#include "harness/engine/adapter.h"

namespace dexcheck {

/// A wrong equation; what is named is the check of its term.
struct FormulaMutant : TriedFault {
  EquationFault equation;
};

/// All that apply to the model and that a comparison of terms can have.
std::vector<FormulaMutant> ListFormulaMutants(const RobotModel& model);

/// Runs the checks on the wrong equation.
void RunFormulaMutant(const Adapter& adapter, int samples, FormulaMutant* mutant);

}  // namespace dexcheck
