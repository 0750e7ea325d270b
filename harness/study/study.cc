#include "harness/study/study.h"

#include <algorithm>
#include <cmath>

#include "controller/common/text.h"
#include "controller/common/toml_reader.h"
#include "harness/study/sampling.h"
#include "harness/study/trial_result.h"

namespace dexcheck {
namespace {

constexpr long kMaxValues = 10000;
constexpr long kMaxSeed = 1L << 53;  // whole numbers that a double holds

double Interpolate(const Variation& variation, double share) {
  const double value = variation.logarithmic ? variation.from * std::pow(variation.to / variation.from, share)
                                             : variation.from + share * (variation.to - variation.from);
  return std::clamp(value, variation.from, variation.to);
}

Variation ReadVariation(const TomlValue& value, Sampling sampling) {
  TomlTable table = value.AsTable();
  Variation variation;
  const TomlValue key = table.Get("key");
  variation.key = key.AsText();
  if (variation.key.empty() || variation.key.find_first_of("= \t\r\n\"") != std::string::npos) {
    key.Fail("must be a key as --set takes it");
  }
  if (sampling == Sampling::kGrid) table.RejectTogether("values", {"from", "to", "count", "spacing"});
  if (const auto list = sampling == Sampling::kGrid ? table.Find("values") : std::nullopt) {
    for (const TomlValue& entry : list->AsList()) {
      const bool are_texts = !variation.labels.empty();
      if (are_texts || (variation.values.empty() && entry.IsText())) {
        variation.values.push_back(static_cast<double>(variation.labels.size()));
        variation.labels.push_back(entry.AsText());
      } else {
        variation.values.push_back(entry.AsNumber());
      }
    }
    if (variation.values.empty()) list->Reject("needs at least one value");
    const auto [least, most] = std::minmax_element(variation.values.begin(), variation.values.end());
    variation.from = *least;
    variation.to = *most;
    table.RejectUnused();
    return variation;
  }
  variation.from = table.Get("from").AsNumber();
  variation.to = table.Get("to").AsNumber();
  if (variation.to <= variation.from) table.Get("to").Fail("must be greater than from");
  if (const auto spacing = table.Find("spacing")) {
    variation.logarithmic = spacing->AsChoice<bool>({{"linear", false}, {"log", true}});
    if (variation.logarithmic) variation.from = table.Get("from").AsPositive();
  }
  const double span = variation.logarithmic ? variation.to / variation.from : variation.to - variation.from;
  if (!std::isfinite(span)) table.Get("to").Fail("must not be so far from from");
  if (sampling == Sampling::kGrid) {
    const long count = table.Get("count").AsWhole(2, kMaxValues);
    for (long i = 0; i < count; ++i) {
      variation.values.push_back(
          Interpolate(variation, static_cast<double>(i) / static_cast<double>(count - 1)));
    }
    variation.values.back() = variation.to;
  }
  table.RejectUnused();
  return variation;
}

void ReadSample(const TomlValue& value, Study* study) {
  TomlTable table = value.AsTable();
  study->sampling = table.Get("method").AsChoice<Sampling>(
      {{"latin_hypercube", Sampling::kLatinHypercube}, {"sobol", Sampling::kSobol}});
  study->samples = table.Get("count").AsWhole(1, kMaxTrials);
  if (const auto seed = table.Find("seed")) {
    study->sample_seed = static_cast<std::uint64_t>(seed->AsWhole(0, kMaxSeed));
  }
  table.RejectUnused();
}

void ReadMetrics(const TomlValue& value, Study* study) {
  std::vector<std::string> known;
  known.reserve(kMetrics.size());
  for (const MetricInfo& metric : kMetrics) known.emplace_back(metric.name);
  for (const TomlValue& entry : value.AsList()) {
    const std::string name = entry.AsName();
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      const std::string nearest = FindNearest(name, known);
      entry.Reject("no metric is called " + Quote(name) +
                   (nearest.empty() ? "" : ", did you mean " + Quote(nearest) + "?"));
    }
    study->metrics.push_back(name);
  }
}

void ReadVariations(const TomlValue& value, Study* study) {
  double trials = static_cast<double>(study->seeds.size());
  if (study->sampling != Sampling::kGrid) trials *= static_cast<double>(study->samples);
  for (const TomlValue& entry : value.AsList()) {
    study->variations.push_back(ReadVariation(entry, study->sampling));
    const Variation& added = study->variations.back();
    if (study->sampling == Sampling::kGrid) trials *= static_cast<double>(added.values.size());
    for (size_t i = 0; i + 1 < study->variations.size(); ++i) {
      if (study->variations[i].key == added.key) entry.Reject(Quote(added.key) + " is varied twice");
    }
  }
  if (study->variations.empty()) value.Reject("needs at least one key");
  if (study->sampling == Sampling::kSobol && study->variations.size() > kMaxSobolDimensions) {
    value.Reject("a Sobol sequence varies at most " + std::to_string(kMaxSobolDimensions) + " keys");
  }
  if (trials > static_cast<double>(kMaxTrials)) {
    value.Reject("makes " + FormatNumber(trials) + " trials; at most " + std::to_string(kMaxTrials) +
                 " can be made");
  }
}

/// Points of the variations' product, the last one fastest.
std::vector<std::vector<double>> MakeGrid(const Study& study) {
  std::vector<std::vector<double>> points = {{}};
  for (const Variation& variation : study.variations) {
    std::vector<std::vector<double>> longer;
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
  if (study.sampling == Sampling::kGrid) return MakeGrid(study);
  const int dimensions = static_cast<int>(study.variations.size());
  std::vector<UnitPoint> points = study.sampling == Sampling::kSobol
                                      ? MakeSobol(dimensions, study.samples)
                                      : MakeLatinHypercube(dimensions, study.samples, study.sample_seed);
  for (UnitPoint& point : points) {
    for (size_t i = 0; i < point.size(); ++i) point[i] = Interpolate(study.variations[i], point[i]);
  }
  return points;
}

}  // namespace

Study ParseStudy(const std::string& text, const std::string& source) {
  Study study;
  study.text = text;
  study.source = source;
  const TomlDocument document(text, source);
  TomlTable root = document.Open();
  root.RejectOthersThan({"name", "description", "scenario", "set", "seeds", "check", "trial_time_limit",
                         "metrics", "sample", "vary"});
  study.name = root.Get("name").AsName();
  if (const auto description = root.Find("description")) study.description = description->AsText();
  study.scenario = root.Get("scenario").AsText();
  if (const auto list = root.Find("set")) {
    for (const TomlValue& entry : list->AsList()) {
      study.overrides.push_back(entry.AsText());
      if (study.overrides.back().find('=') == std::string::npos) entry.Fail("must be KEY=VALUE");
    }
  }
  if (const auto list = root.Find("seeds")) {
    study.seeds.clear();
    for (const TomlValue& entry : list->AsList()) {
      study.seeds.push_back(static_cast<std::uint64_t>(entry.AsWhole(0, kMaxSeed)));
    }
    if (study.seeds.empty()) list->Reject("needs at least one seed");
  }
  if (const auto check = root.Find("check")) study.check = check->AsFlag();
  if (const auto limit = root.Find("trial_time_limit")) study.trial_time_limit = limit->AsPositive();
  if (const auto metrics = root.Find("metrics")) ReadMetrics(*metrics, &study);
  if (const auto sample = root.Find("sample")) ReadSample(*sample, &study);
  ReadVariations(root.Get("vary"), &study);
  return study;
}

std::vector<Trial> ListTrials(const Study& study) {
  std::vector<Trial> trials;
  for (const std::vector<double>& point : MakePoints(study)) {
    for (const std::uint64_t seed : study.seeds) {
      trials.push_back({static_cast<long>(trials.size()), seed, point});
    }
  }
  return trials;
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

}  // namespace dexcheck
