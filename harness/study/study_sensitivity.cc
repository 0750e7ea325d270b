#include "harness/study/study_sensitivity.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace dexcheck {

std::vector<size_t> Sensitivity::ListByImportance() const {
  std::vector<size_t> keys(std::max(sobol.size(), morris.size()));
  std::iota(keys.begin(), keys.end(), size_t{0});
  const auto importance = [&](size_t i) {
    return sobol.empty() ? morris[i].size.value : sobol[i].total.value;
  };
  std::stable_sort(keys.begin(), keys.end(),
                   [&](size_t a, size_t b) { return importance(a) > importance(b); });
  return keys;
}

Sensitivity AnalyseSensitivity(const Study& study, const std::vector<TrialRow>& rows,
                               const std::string& expression) {
  const int dimensions = static_cast<int>(study.num_keys());
  const long per_point = CountTrialsOfPoint(study);
  const auto count = static_cast<size_t>(CountUnitPoints(study.sample, dimensions));
  std::vector<double> values(count, 0.0);
  std::vector<long> done(count, 0);
  for (const TrialRow& row : rows) {
    const auto point = static_cast<size_t>(row.trial.number / per_point);
    if (point >= count) continue;
    values[point] += IsHeld(row.result.outcome) ? EvaluateMetrics(expression, row.result) : std::nan("");
    ++done[point];
  }
  Sensitivity sensitivity;
  sensitivity.expression = expression;
  for (size_t i = 0; i < count; ++i) {
    values[i] = done[i] == per_point ? values[i] / static_cast<double>(per_point) : std::nan("");
    if (!std::isfinite(values[i])) ++sensitivity.left_out;
  }
  if (study.sample.method == SamplingMethod::kSaltelli) {
    sensitivity.sobol = CalcSobolIndices(values, dimensions);
  } else {
    sensitivity.morris = CalcMorrisEffects(MakeUnitPoints(study.sample, dimensions), values);
  }
  return sensitivity;
}

std::vector<std::string> ListQuantities(const Study& study, const std::vector<TrialRow>& rows) {
  std::vector<std::string> quantities;
  for (const Objective& objective : study.objectives) quantities.push_back(objective.expression);
  if (quantities.empty()) quantities = study.metrics;
  if (quantities.empty()) quantities.emplace_back(kMetrics[FindErrorMetric(rows)].name);
  return quantities;
}

std::string Describe(const Study& study, const Sensitivity& sensitivity) {
  constexpr size_t kNamed = 3;
  constexpr double kMatters = 0.01;  // of the variance
  if (sensitivity.empty()) return sensitivity.expression + " does not vary, or too few trials were held.";
  const std::vector<size_t> keys = sensitivity.ListByImportance();
  std::string text = sensitivity.expression + ":";
  size_t named = 0;
  for (const size_t i : keys) {
    if (named == kNamed) break;
    const std::string& key = study.variations[i].key;
    const std::string separator = named == 0                                   ? " "
                                  : named + 1 == std::min(kNamed, keys.size()) ? " and "
                                                                               : ", ";
    if (sensitivity.sobol.empty()) {
      const MorrisEffect& effect = sensitivity.morris[i];
      text +=
          fmt::format("{}{} moves it by {:.3g} ({:.3g} to {:.3g}){} over its range", separator, key,
                      effect.size.value, effect.size.low, effect.size.high, ShowUnit(sensitivity.expression));
    } else {
      const SobolIndex& index = sensitivity.sobol[i];
      text += fmt::format("{}{} explains {:.0f} % ({:.0f} to {:.0f}) of its variance, {:.0f} % alone",
                          separator, key, 100.0 * index.total.value, 100.0 * index.total.low,
                          100.0 * index.total.high, 100.0 * std::max(index.first.value, 0.0));
    }
    ++named;
  }
  if (sensitivity.sobol.empty()) {
    constexpr double kSmall = 0.1;
    const double largest = sensitivity.morris[keys.front()].size.value;
    const auto idle = std::count_if(keys.begin(), keys.end(), [&](size_t i) {
      return sensitivity.morris[i].size.high < kSmall * largest;
    });
    if (idle > 0)
      text += fmt::format("; {} of {} keys move it by less than a tenth of the first", idle, keys.size());
  } else {
    const auto idle = std::count_if(keys.begin(), keys.end(),
                                    [&](size_t i) { return sensitivity.sobol[i].total.high < kMatters; });
    if (idle > 0) text += fmt::format("; {} of {} keys explain less than 1 %", idle, keys.size());
  }
  if (sensitivity.left_out > 0) text += fmt::format(" ({} points have no value)", sensitivity.left_out);
  return text + ".";
}

}  // namespace dexcheck
