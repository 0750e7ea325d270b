#include "harness/study/study.h"

#include <algorithm>
#include <cmath>

#include "controller/common/text.h"
#include "harness/study/sampling.h"

namespace dexcheck {
namespace {

/// Points of the variations' product, the last one fastest.
std::vector<std::vector<double>> MakeGrid(const std::vector<Variation>& variations) {
  std::vector<std::vector<double>> points = {{}};
  for (const Variation& variation : variations) {
    std::vector<std::vector<double>> longer;
    longer.reserve(points.size() * variation.values.size());
    for (const std::vector<double>& point : points) {
      for (const double value : variation.values) {
        longer.push_back(point);
        longer.back().push_back(value);
      }
    }
    points = std::move(longer);
  }
  return points;
}

std::vector<std::vector<double>> MakePoints(const Study& study) {
  if (study.sample.method == SamplingMethod::kGrid) return MakeGrid(study.variations);
  std::vector<UnitPoint> points = MakeUnitPoints(study.sample, static_cast<int>(study.variations.size()));
  for (UnitPoint& point : points) point = ValuesAt(study.variations, point);
  return points;
}

}  // namespace

double ValueAt(const Variation& variation, double fraction) {
  if (!variation.values.empty()) {
    const auto count = static_cast<double>(variation.values.size());
    return variation.values[static_cast<size_t>(std::clamp(std::floor(fraction * count), 0.0, count - 1.0))];
  }
  const double value = variation.logarithmic
                           ? variation.from * std::pow(variation.to / variation.from, fraction)
                           : variation.from + fraction * (variation.to - variation.from);
  return std::clamp(value, variation.from, variation.to);
}

double FractionOf(const Variation& variation, double value) {
  if (!variation.values.empty()) {
    const auto found = std::ranges::find(variation.values, value);
    return (static_cast<double>(found - variation.values.begin()) + 0.5) /
           static_cast<double>(variation.values.size());
  }
  const double fraction = variation.logarithmic
                              ? std::log(value / variation.from) / std::log(variation.to / variation.from)
                              : (value - variation.from) / (variation.to - variation.from);
  return std::clamp(fraction, 0.0, 1.0);
}

std::vector<double> ValuesAt(const std::vector<Variation>& variations, const std::vector<double>& fractions) {
  std::vector<double> values;
  for (size_t i = 0; i < fractions.size(); ++i) values.push_back(ValueAt(variations[i], fractions[i]));
  return values;
}

long CountTrialsOfPoint(const Study& study) { return static_cast<long>(study.seeds.size()); }

long CountTrials(const Study& study) {
  constexpr double kMost = 1e18;
  double points = 1.0;  // of many keys more than whole numbers can count
  if (study.is_search()) {
    points = static_cast<double>(study.search.count);
  } else if (study.sample.method != SamplingMethod::kGrid) {
    points = static_cast<double>(CountUnitPoints(study.sample, static_cast<int>(study.variations.size())));
  } else {
    for (const Variation& variation : study.variations)
      points *= static_cast<double>(variation.values.size());
  }
  return std::lround(std::min(points * static_cast<double>(CountTrialsOfPoint(study)), kMost));
}

std::vector<Trial> ListTrialsOfPoint(const Study& study, long number, const std::vector<double>& point) {
  std::vector<Trial> trials;
  long next = number * CountTrialsOfPoint(study);
  for (const std::uint64_t seed : study.seeds) trials.push_back({next++, seed, point});
  return trials;
}

std::vector<Trial> ListTrials(const Study& study) {
  std::vector<Trial> all;
  all.reserve(static_cast<size_t>(CountTrials(study)));
  long number = 0;
  for (const std::vector<double>& point : MakePoints(study)) {
    std::vector<Trial> trials = ListTrialsOfPoint(study, number++, point);
    std::move(trials.begin(), trials.end(), std::back_inserter(all));
  }
  return all;
}

std::string FormatValue(const Variation& variation, double value) {
  if (variation.labels.empty()) return FormatNumber(value);
  return variation.labels.at(static_cast<size_t>(std::lround(value)));
}

std::vector<std::string> ListOverrides(const Study& study, const Trial& trial) {
  std::vector<std::string> overrides = study.overrides;
  for (size_t i = 0; i < study.variations.size(); ++i) {
    overrides.push_back(study.variations[i].key + "=" +
                        FormatValue(study.variations[i], trial.parameters[i]));
  }
  return overrides;
}

bool NeedsMargins(const Study& study) {
  const auto is_of_margins = [](const std::string& text) {
    return text.find("gain_margin") != std::string::npos || text.find("phase_margin") != std::string::npos ||
           text.find("delay_margin") != std::string::npos;
  };
  return std::ranges::any_of(study.metrics, is_of_margins) ||
         std::ranges::any_of(study.objectives, is_of_margins, &Objective::expression) ||
         std::ranges::any_of(study.constraints, is_of_margins, &Constraint::text);
}

std::string FindDifference(const Study& before, const Study& now) {
  if (before.scenario != now.scenario) return "scenario";
  if (before.controller != now.controller) return "controller";
  if (before.overrides != now.overrides) return "set";
  if (before.variations != now.variations) return "vary";
  if (before.sample != now.sample) return "sample";
  if (before.search != now.search) return "search";
  if (before.seeds != now.seeds) return "seeds";
  if (before.check != now.check) return "check";
  if (before.stop_error != now.stop_error) return "stop_error";
  const bool lack_margins = NeedsMargins(now) && !NeedsMargins(before);
  if (lack_margins && before.metrics != now.metrics) return "metrics";
  if (!lack_margins && !now.is_search()) return "";
  if (before.objectives != now.objectives) return "objective";
  return before.constraints != now.constraints ? "constraints" : "";
}

}  // namespace dexcheck
