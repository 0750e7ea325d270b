#pragma once

// Why model and engine disagree: the fewest changes of the analytic model after which they agree.

#include <functional>
#include <string>
#include <vector>

#include "controller/model/parameter_reader.h"
#include "harness/checks/consistency.h"
#include "harness/diagnosis/repair.h"

namespace dexcheck {

struct DiagnosisOptions {
  int samples = 6;  ///< Random states; each gives some hundred residuals.
  std::uint64_t seed = 1;
  /// Relative difference that is no fault, since published numbers are rounded; 0: what rounding of doubles
  /// leaves.
  double tolerance = 0.0;
};

struct Diagnosis {
  bool agrees = true;
  std::vector<Repair> causes;  ///< The one that explains most first.
  double explained = 0.0;      ///< Fraction of all residuals, squared and scaled, that they explain together.
  double explained_of_forces = 0.0;
  /// All residuals, squared and scaled, before the repairs; and those of forces alone.
  double residual = 0.0, residual_of_forces = 0.0;
  std::vector<ConstantFinding> remaining_constants;  ///< What disagrees after all repairs.
  std::vector<CheckRecord> remaining_terms;          ///< Failed checks after all repairs.
  RobotSpec written;   ///< The model's numbers as they stand in its file, which is what the causes change;
  RobotSpec repaired;  ///< and with them repaired.
};

/// Compares, and explains what differs. Stages, each with what was found before repaired: what only the MJCF
/// has; constants that no motion shows (ranges, radii, the object); geometry from the base outward; bodies,
/// joint constants and gravity by reading them. @throws InputError when model and engine do not match.
/// @param rows how the model's rows are written in its file; none stands for modified parameters.
/// @param progress called between stages with what follows; its false ends the work with what there is.
Diagnosis Diagnose(const RobotModel& model, const mjModel& engine, const std::string& engine_source,
                   const DiagnosisOptions& options, const std::function<bool(const char*)>& progress,
                   std::vector<WrittenRow> rows = {});

}  // namespace dexcheck
