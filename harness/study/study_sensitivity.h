#pragma once

// Which of a study's keys matters for what.

#include <string>
#include <vector>

#include "harness/study/sensitivity.h"
#include "harness/study/study_store.h"

namespace dexcheck {

/// What the points of a study with `method = "saltelli"` or `"morris"` show of one quantity.
struct Sensitivity {
  std::string expression;            ///< Of metrics.
  std::vector<SobolIndex> sobol;     ///< Of "saltelli", by key.
  std::vector<MorrisEffect> morris;  ///< Of "morris", by key.
  long left_out = 0;                 ///< Points without a value: a trial was not held, or is missing.

  /// Keys by their total index or effect, the largest first.
  [[nodiscard]] std::vector<size_t> ListByImportance() const;
  [[nodiscard]] bool empty() const { return sobol.empty() && morris.empty(); }
};

/// Of a point's trials the mean is taken.
Sensitivity AnalyseSensitivity(const Study& study, const std::vector<TrialRow>& rows,
                               const std::string& expression);

/// The quantities of a study of this kind: its objectives, else its metrics, else the error of its trials.
std::vector<std::string> ListQuantities(const Study& study, const std::vector<TrialRow>& rows);

/// "energy: x1 explains 62 % of the variance, 55 to 70 %, with its interactions; then ...".
std::string Describe(const Study& study, const Sensitivity& sensitivity);

}  // namespace dexcheck
