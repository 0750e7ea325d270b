#include "harness/study/study_csv.h"

#include <cmath>

#include "controller/common/text.h"

namespace dexcheck {

std::string QuoteField(const std::string& text) {
  const bool is_formula = text.find_first_of("=+-@\t\r") == 0;
  if (!is_formula && text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = is_formula ? "\"'" : "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

void WriteStudyCsv(const StudyStore& store, const std::function<void(std::string_view)>& write) {
  const Study& study = store.study();
  std::string line = "trial,seed";
  for (const Variation& variation : study.variations) line += "," + QuoteField(variation.key);
  line += ",outcome,failure";
  for (const MetricInfo& metric : kMetrics) line += std::string(",") + metric.name;
  write(line + ",machine\n");
  store.ForEachRow([&](const TrialRow& row) {
    line = std::to_string(row.trial.number) + "," + std::to_string(row.trial.seed);
    for (size_t i = 0; i < study.variations.size(); ++i) {
      const std::string value = FormatValue(study.variations[i], row.trial.parameters[i]);
      line += "," + (study.variations[i].labels.empty() ? value : QuoteField(value));
    }
    line += std::string(",") + NameOf(row.result.outcome) + "," + QuoteField(row.result.failure);
    for (const double metric : row.result.metrics)
      line += "," + (std::isfinite(metric) ? FormatNumber(metric) : "");
    write(line + "," + QuoteField(row.machine) + "\n");
  });
}

}  // namespace dexcheck
