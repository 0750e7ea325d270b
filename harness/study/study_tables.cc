#include "harness/study/study_tables.h"

#include <fmt/format.h>

#include <algorithm>

#include "harness/study/margin_search.h"
#include "harness/study/study_sensitivity.h"
#include "harness/study/study_theory.h"

namespace dexcheck {
namespace {

std::string FormatPlace(double fraction) {
  return fmt::format("{:.2f}%", 100.0 * std::clamp(fraction, 0.0, 1.0));
}

/// A bar from 0 to `value`, with the interval drawn over it; all of them relative to `most`.
Html MakeBar(const Estimate& estimate, double most) {
  const double low = std::max(estimate.low, 0.0) / most;
  const double high = std::max(estimate.high, 0.0) / most;
  return FormatHtml(
      "<div class=\"track\"><i class=\"fill\" style=\"left:0;width:{}\"></i><i class=\"span\" "
      "style=\"left:{};width:{}\"></i></div>",
      FormatPlace(estimate.value / most), FormatPlace(low), FormatPlace(high - low));
}

Html MakeSensitivityTable(const StudyResults& results, const std::string& quantity,
                          const std::vector<bool>& known) {
  const Sensitivity sensitivity = AnalyseSensitivity(results.study, results.rows, quantity);
  if (sensitivity.empty()) return {};
  const bool is_sobol = !sensitivity.sobol.empty();
  const std::vector<size_t> keys = sensitivity.ListByImportance();
  const auto find = [&](size_t key) {
    return is_sobol ? sensitivity.sobol[key].total : sensitivity.morris[key].size;
  };
  double most = 0.0;
  for (const size_t key : keys) most = std::max(most, find(key).high);
  Html html = FormatHtml(
      "<section class=\"card scroll\"><h3>{}</h3>\n<table class=\"effects\"><tr><th>key</th><th "
      "class=\"wide\">{}</th><th class=\"value\"></th><th class=\"value\">{}</th></tr>\n",
      quantity + (ShowUnit(quantity).empty() ? "" : "," + ShowUnit(quantity)),
      is_sobol ? "fraction of the variance, with interactions" : "moves it over its range by",
      is_sobol ? "alone" : "spread");
  for (const size_t key : keys) {
    const Estimate estimate = find(key);
    html += FormatHtml(
        "<tr><td>{}{}</td><td>{}</td><td class=\"value number\">{}</td><td class=\"value "
        "number\">{}</td></tr>\n",
        results.study.variations[key].key, known[key] ? " (57)" : "",
        MakeBar(estimate, most > 0.0 ? most : 1.0), fmt::format("{:.3g}", estimate.value),
        fmt::format("{:.3g}",
                    is_sobol ? sensitivity.sobol[key].first.value : sensitivity.morris[key].spread));
  }
  html += "</table></section>\n";
  return html;
}

}  // namespace

Html MakeSensitivityTables(const StudyResults& results) {
  const SamplingMethod method = results.study.sample.method;
  if (results.study.is_search() || (method != SamplingMethod::kSaltelli && method != SamplingMethod::kMorris))
    return {};
  const KeyTheory theory = FindKeyTheory(results.inputs, results.rows.front().trial.parameters);
  Html tables;
  for (const std::string& quantity : ListQuantities(results.study, results.rows))
    tables += MakeSensitivityTable(results, quantity, theory.knows);
  if (tables.empty()) return {};
  return FormatHtml(
      "<h2 id=\"effects\">Which key matters</h2>\n<p class=\"soft\">The line over a bar is the interval that "
      "holds the value with 95 %.{} The error dynamics have the keys that are marked with (57).</p>\n<div "
      "class=\"grid\">\n{}</div>\n",
      method == SamplingMethod::kMorris
          ? " Spread is 0 where the quantity is linear in the key and the others do not matter to its effect."
          : "",
      tables);
}

Html MakeMarginTable(const StudyResults& results) {
  const Study& study = results.study;
  if (study.search.method != SearchMethod::kMargins) return {};
  const std::vector<JudgedPoint> points = JudgePoints(study, results.rows);
  const std::vector<Margin> margins = FindMargins(study, points);
  if (margins.empty()) return {};
  const KeyTheory theory = FindKeyTheory(results.inputs, results.rows.front().trial.parameters);
  Html html(
      "<h2 id=\"margins\">How far each key can go</h2>\n<div class=\"card scroll\"><table "
      "class=\"effects\"><tr><th>key</th><th class=\"value\">from</th><th class=\"wide\"></th><th "
      "class=\"value\">to</th><th class=\"value\">start</th><th class=\"value\">(57) turns "
      "unstable</th></tr>\n");
  for (size_t key = 0; key < study.num_keys(); ++key) {
    const Variation& variation = study.variations[key];
    const Margin& down = margins[2 * key];
    const Margin& up = margins[2 * key + 1];
    const auto show = [&](const Margin& margin) {
      return fmt::format("{:.4g}{}", ValueAt(variation, margin.good[key]),
                         margin.bad.empty() ? " (end)" : "");
    };
    std::string turns;
    Html marks;
    for (const KeyTheory::Turn& turn : theory.turns) {
      if (turn.key != key || !turn.is_stability) continue;
      turns += fmt::format("{}{:.4g}", turns.empty() ? "" : ", ", turn.value);
      marks += FormatHtml("<i class=\"mark\" style=\"left:{}\"></i>",
                          FormatPlace(FractionOf(variation, turn.value)));
    }
    html += FormatHtml(
        "<tr><td>{}</td><td class=\"value number\">{}</td><td><div class=\"track\"><i class=\"fill\" "
        "style=\"left:{};width:{}\"></i><i class=\"start\" style=\"left:{}\"></i>{}</div></td><td "
        "class=\"value number\">{}</td><td class=\"value number\">{}</td><td class=\"value "
        "number\">{}</td></tr>\n",
        variation.key, show(down), FormatPlace(down.good[key]), FormatPlace(up.good[key] - down.good[key]),
        FormatPlace(FractionOf(variation, points[0].values[key])), marks, show(up),
        fmt::format("{:.4g}", points[0].values[key]), turns.empty() ? "–" : turns);
  }
  html +=
      "</table><p class=\"soft\">The whole track is the range of the key; the bar is what was tried and is "
      "good, the "
      "other keys as at the start. Beyond its ends a constraint does not hold.</p></div>\n";
  return html;
}

}  // namespace dexcheck
