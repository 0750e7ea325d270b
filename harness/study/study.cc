#include "harness/study/study.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "controller/common/text.h"
#include "controller/common/toml_reader.h"
#include "harness/scenario/scenario_reader.h"
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

namespace {

constexpr long kMaxValues = 10000;
constexpr long kMaxSeed = 1L << 53;  // whole numbers that a double holds

/// Texts, flags and lists have no order: their numbers stand for them.
bool IsWord(const TomlValue& value) {
  const std::string shown = value.Show();
  return value.IsText() || shown == "true" || shown == "false" || shown.starts_with('[');
}

void ReadValues(const TomlValue& list, Variation* variation) {
  for (const TomlValue& entry : list.AsList()) {
    const bool are_words = !variation->labels.empty();
    if (are_words || (variation->values.empty() && IsWord(entry))) {
      if (!IsWord(entry)) entry.Fail("must be a text, a flag or a list as the first one is");
      variation->values.push_back(static_cast<double>(variation->labels.size()));
      variation->labels.push_back(entry.IsText() ? entry.AsText() : entry.Show());
    } else {
      variation->values.push_back(entry.AsNumber());
    }
  }
  if (variation->values.empty()) list.Reject("needs at least one value");
  const auto [least, most] = std::minmax_element(variation->values.begin(), variation->values.end());
  variation->from = *least;
  variation->to = *most;
}

void ReadRange(TomlTable* table, bool is_grid, Variation* variation) {
  variation->from = table->Get("from").AsNumber();
  variation->to = table->Get("to").AsNumber();
  if (variation->to <= variation->from) table->Get("to").Fail("must be greater than from");
  if (const auto spacing = table->Find("spacing")) {
    variation->logarithmic = spacing->AsChoice<bool>({{"linear", false}, {"log", true}});
    if (variation->logarithmic) variation->from = table->Get("from").AsPositive();
  }
  const double span =
      variation->logarithmic ? variation->to / variation->from : variation->to - variation->from;
  if (!std::isfinite(span)) table->Get("to").Fail("must not be so far from from");
  if (!is_grid) return;
  const long count = table->Get("count").AsWhole(2, kMaxValues);
  std::vector<double> values;
  for (long i = 0; i < count; ++i) {
    values.push_back(ValueAt(*variation, static_cast<double>(i) / static_cast<double>(count - 1)));
  }
  values.back() = variation->to;
  variation->values = std::move(values);
}

Variation ReadVariation(const TomlValue& value, bool is_grid) {
  TomlTable table = value.AsTable();
  Variation variation;
  const TomlValue key = table.Get("key");
  variation.key = key.AsText();
  if (variation.key.empty() || variation.key.find_first_of("= \t\r\n\"") != std::string::npos) {
    key.Fail("must be a key as --set takes it");
  }
  table.RejectTogether("values", {"from", "to", "count", "spacing"});
  if (const auto list = table.Find("values")) {
    ReadValues(*list, &variation);
  } else {
    ReadRange(&table, is_grid, &variation);
  }
  table.RejectUnused();
  return variation;
}

void ReadVariations(const TomlValue& value, bool is_grid, Study* study) {
  for (const TomlValue& entry : value.AsList()) {
    study->variations.push_back(ReadVariation(entry, is_grid));
    const Variation& added = study->variations.back();
    for (size_t i = 0; i + 1 < study->variations.size(); ++i) {
      if (study->variations[i].key == added.key) entry.Reject(Quote(added.key) + " is varied twice");
    }
  }
}

Sample ReadSample(const TomlValue& value) {
  TomlTable table = value.AsTable();
  Sample sample;
  sample.method =
      table.Get("method").AsChoice<SamplingMethod>({{"latin_hypercube", SamplingMethod::kLatinHypercube},
                                                    {"sobol", SamplingMethod::kSobol},
                                                    {"random", SamplingMethod::kRandom},
                                                    {"morris", SamplingMethod::kMorris}});
  sample.count = table.Get("count").AsWhole(1, kMaxTrials);
  if (const auto seed = table.Find("seed"))
    sample.seed = static_cast<std::uint64_t>(seed->AsWhole(0, kMaxSeed));
  if (const auto scramble = table.Find("scramble")) {
    sample.scramble = scramble->AsFlag();
    if (sample.method != SamplingMethod::kSobol) scramble->Fail("is for a Sobol sequence");
  }
  table.RejectUnused();
  return sample;
}

void ReadMetrics(TomlTable& root, Study* study) {
  std::vector<std::string> known;
  for (const MetricInfo& metric : kMetrics) known.emplace_back(metric.name);
  for (const TomlValue& entry : root.FindList("metrics")) {
    const std::string name = entry.AsName();
    if (!FindMetric(name)) entry.Reject("no metric is called " + Quote(name) + SuggestNearest(name, known));
    study->metrics.push_back(name);
  }
}

Objective ReadObjective(const TomlValue& value) {
  TomlTable table = value.AsTable();
  Objective objective;
  table.RejectTogether("maximize", {"minimize"});
  const auto maximize = table.Find("maximize");
  const TomlValue expression = maximize ? *maximize : table.Get("minimize");
  objective.maximize = maximize.has_value();
  objective.expression = expression.AsText();
  try {
    RequireMetricExpression(objective.expression);
  } catch (const std::invalid_argument& error) {
    expression.Reject(error.what());
  }
  if (const auto aggregate = table.Find("aggregate")) {
    objective.aggregate = aggregate->AsChoice<Aggregate>(
        {{"mean", Aggregate::kMean}, {"worst", Aggregate::kWorst}, {"quantile", Aggregate::kQuantile}});
  }
  if (objective.aggregate == Aggregate::kQuantile) {
    const TomlValue quantile = table.Get("quantile");
    objective.quantile = quantile.AsPositive();
    if (objective.quantile > 1.0) quantile.Fail("must be at most 1");
  }
  table.RejectUnused();
  return objective;
}

Constraint ReadConstraint(const TomlValue& value) {
  const auto parse = [](const TomlValue& text) {
    try {
      return ParseConstraint(text.AsText());
    } catch (const std::invalid_argument& error) {
      text.Reject(error.what());
    }
  };
  if (value.IsText()) return parse(value);
  TomlTable table = value.AsTable();
  Constraint constraint = parse(table.Get("require"));
  if (const auto fraction = table.Find("fraction")) {
    constraint.fraction = fraction->AsPositive();
    if (constraint.fraction > 1.0) fraction->Fail("must be at most 1");
  }
  table.RejectUnused();
  return constraint;
}

void ReadStart(const TomlValue& value, Study* study) {
  Search& search = study->search;
  if (value.IsText()) {
    if (value.AsText() != "middle") value.Fail("must be \"middle\" or a value for each key");
    return;
  }
  const std::vector<TomlValue> list = value.AsList();
  if (list.size() != study->variations.size()) {
    value.Reject("needs a value for each of the " + std::to_string(study->variations.size()) + " keys");
  }
  for (size_t i = 0; i < list.size(); ++i) {
    const Variation& variation = study->variations[i];
    const double start = list[i].AsNumber();
    if (start < variation.from || start > variation.to) {
      list[i].Fail("must be from " + FormatNumber(variation.from) + " to " + FormatNumber(variation.to) +
                   ", as " + Quote(variation.key) + " is");
    }
    search.start_values.push_back(start);
  }
}

void ReadSearch(const TomlValue& value, Study* study) {
  constexpr long kLeastPopulation = 5;  // of which CMA-ES takes the better half
  constexpr long kMaxPopulation = 10000;
  constexpr long kMaxStarts = 1000;
  constexpr long kMaxSearchSeed = (1L << 32) - 1;  // the libraries' generators take 32 bits
  TomlTable table = value.AsTable();
  Search& search = study->search;
  const TomlValue method = table.Get("method");
  search.method = method.AsChoice<SearchMethod>(
      {{"cma_es", SearchMethod::kCmaEs}, {"nelder_mead", SearchMethod::kNelderMead}});
  const TomlValue count = table.Get("count");
  search.count = count.AsWhole(1, kMaxTrials);
  if (search.method == SearchMethod::kCmaEs) {
    search.population = 16;
    if (const auto population = table.Find("population"))
      search.population = population->AsWhole(kLeastPopulation, kMaxPopulation);
    if (search.count < search.population)
      count.Fail("must be at least the population, " + std::to_string(search.population));
    search.count -= search.count % search.population;  // whole generations
  } else {
    if (const auto starts = table.Find("starts")) search.starts = starts->AsWhole(1, kMaxStarts);
    if (const auto tolerance = table.Find("tolerance")) search.tolerance = tolerance->AsPositive();
    if (search.count < search.starts) count.Fail("must be at least the number of starts");
  }
  if (const auto step = table.Find("step")) {
    search.step = step->AsPositive();
    if (search.step > 1.0) step->Fail("must be at most 1, the whole range");
  }
  if (const auto seed = table.Find("seed"))
    search.seed = static_cast<std::uint64_t>(seed->AsWhole(0, kMaxSearchSeed));
  if (const auto start = table.Find("start")) ReadStart(*start, study);
  table.RejectUnused();
  if (study->objectives.size() != 1)
    method.Reject(study->objectives.empty() ? "a search needs an [[objective]]"
                                            : "a search looks for the best of one objective");
}

void RequireFewTrials(const TomlValue& where, const Study& study) {
  const long trials = CountTrials(study);
  if (trials <= kMaxTrials) return;
  where.Reject("makes " + FormatNumber(static_cast<double>(trials)) + " trials; at most " +
               std::to_string(kMaxTrials) + " can be made");
}

/// @param study with its text and source.
Study ReadStudy(TomlTable& root, Study study) {
  root.RejectOthersThan({"name", "description", "scenario", "controller", "set", "seeds", "check",
                         "trial_time_limit", "stop_error", "metrics", "sample", "search", "objective",
                         "constraints", "vary"});
  study.name = root.Get("name").AsName();
  if (const auto description = root.Find("description")) study.description = description->AsText();
  study.scenario = root.Get("scenario").AsText();
  if (const auto controller = root.Find("controller")) study.controller = controller->AsText();
  for (const TomlValue& entry : root.FindList("set")) {
    study.overrides.push_back(entry.AsText());
    if (study.overrides.back().find('=') == std::string::npos) entry.Fail("must be KEY=VALUE");
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
  if (const auto error = root.Find("stop_error")) study.stop_error = error->AsPositive();
  ReadMetrics(root, &study);
  root.RejectTogether("search", {"sample"});
  const auto search = root.Find("search");
  if (const auto sample = root.Find("sample")) study.sample = ReadSample(*sample);
  const TomlValue vary = root.Get("vary");
  ReadVariations(vary, study.sample.method == SamplingMethod::kGrid && !search, &study);
  if (study.variations.empty()) vary.Reject("needs at least one key");
  if (study.sample.method == SamplingMethod::kSobol && study.variations.size() > kMaxSobolDimensions)
    vary.Reject("a Sobol sequence varies at most " + std::to_string(kMaxSobolDimensions) + " keys");
  for (const TomlValue& entry : root.FindList("objective")) study.objectives.push_back(ReadObjective(entry));
  for (const TomlValue& entry : root.FindList("constraints"))
    study.constraints.push_back(ReadConstraint(entry));
  if (search) ReadSearch(*search, &study);
  RequireFewTrials(vary, study);
  return study;
}

}  // namespace

Study ParseStudy(const std::string& text, const std::string& source) {
  Study study;
  study.text = text;
  study.source = source;
  const TomlDocument document(text, source);
  return document.Read([&](TomlTable root) { return ReadStudy(root, study); });
}

}  // namespace dexcheck
