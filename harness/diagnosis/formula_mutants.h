#pragma once

// Wrong equations made on purpose, which no parameter can express: put in the checks' way in place of the
// model's.

#include <functional>
#include <string>
#include <vector>

#include "harness/checks/contact_check.h"
#include "harness/diagnosis/mutation.h"

namespace dexcheck {

/// A wrong equation; what is named is the check that it fails.
struct FormulaMutant : TriedFault {
  std::string first;           ///< The check that a fault of this kind should fail.
  ConsistencyOptions options;  ///< With the fault in make_view or object.
  ContactFormulas contact;     ///< Or here,
  bool of_contact = false;     ///< and then only the contact check is run.
  bool of_model = false;       ///< The fault is in make_view.
};

/// All that apply to the model: those of the object and of contacts need an object and fingertips.
std::vector<FormulaMutant> ListFormulaMutants(const RobotModel& model);

/// Runs the checks on the wrong equation.
void RunFormulaMutant(const Adapter& adapter, int samples, FormulaMutant* mutant);

}  // namespace dexcheck
