#include "harness/study/study_change.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

namespace dexcheck {
namespace {

/// A trial's seed and the values of all keys as they are written, by the order of the keys in `study`.
using TrialName = std::pair<std::uint64_t, std::vector<std::string>>;

TrialName NameTrial(const Study& study, const Trial& trial, const std::vector<size_t>& order) {
  TrialName name{trial.seed, {}};
  for (const size_t i : order) name.second.push_back(FormatValue(study.variations[i], trial.parameters[i]));
  return name;
}

/// For each key of `now` its place in `before`; the last place + 1 where it is not there.
std::vector<size_t> FindPlaces(const Study& before, const Study& now) {
  std::vector<size_t> places;
  for (const Variation& variation : now.variations) {
    const auto found = std::find_if(before.variations.begin(), before.variations.end(),
                                    [&](const Variation& other) { return other.key == variation.key; });
    places.push_back(static_cast<size_t>(found - before.variations.begin()));
  }
  return places;
}

bool IsSameVariation(const Variation& a, const Variation& b) {
  return a.key == b.key && a.values == b.values && a.labels == b.labels && a.from == b.from && a.to == b.to &&
         a.logarithmic == b.logarithmic;
}

bool IsSameSample(const Sample& a, const Sample& b) {
  return a.method == b.method && a.count == b.count && a.seed == b.seed && a.scramble == b.scramble;
}

std::string FindSearchDifference(const Study& before, const Study& now) {
  const Search& a = before.search;
  const Search& b = now.search;
  if (a.method != b.method || a.population != b.population || a.starts != b.starts ||
      a.directions != b.directions || a.step != b.step || a.tolerance != b.tolerance || a.seed != b.seed ||
      a.start != b.start || a.start_values != b.start_values) {
    return "search";
  }
  if (!now.is_search()) return {};
  const auto same_objective = [](const Objective& x, const Objective& y) {
    return x.expression == y.expression && x.maximize == y.maximize && x.aggregate == y.aggregate &&
           x.quantile == y.quantile;
  };
  const auto same_constraint = [](const Constraint& x, const Constraint& y) {
    return x.text == y.text && x.fraction == y.fraction;
  };
  if (!std::equal(before.objectives.begin(), before.objectives.end(), now.objectives.begin(),
                  now.objectives.end(), same_objective)) {
    return "objective";
  }
  if (!std::equal(before.constraints.begin(), before.constraints.end(), now.constraints.begin(),
                  now.constraints.end(), same_constraint)) {
    return "constraints";
  }
  if (!std::equal(before.variations.begin(), before.variations.end(), now.variations.begin(),
                  now.variations.end(), IsSameVariation)) {
    return "vary";
  }
  if (!IsSameSample(before.nested, now.nested) || before.num_nested != now.num_nested) return "nested";
  return before.seeds != now.seeds ? "seeds" : "";
}

}  // namespace

std::string FindDifference(const Study& before, const Study& now) {
  if (before.scenario != now.scenario) return "scenario";
  if (before.overrides != now.overrides) return "set";
  if (before.check != now.check) return "check";
  if (before.stop_error != now.stop_error) return "stop_error";
  if (before.variations.size() != now.variations.size()) return "keys of vary";
  for (const size_t place : FindPlaces(before, now)) {
    if (place == before.variations.size()) return "keys of vary";
  }
  return FindSearchDifference(before, now);
}

bool HasSameTrials(const Study& before, const Study& now) {
  return FindDifference(before, now).empty() && before.seeds == now.seeds &&
         before.num_nested == now.num_nested && before.search.count == now.search.count &&
         IsSameSample(before.sample, now.sample) && IsSameSample(before.nested, now.nested) &&
         std::equal(before.variations.begin(), before.variations.end(), now.variations.begin(),
                    now.variations.end(), IsSameVariation);
}

StudyChange ChangeStudy(const Study& before, const Study& now, std::vector<TrialRow> rows) {
  StudyChange change;
  if (now.is_search()) {  // of which only the number of points may differ
    change.kept = static_cast<long>(rows.size());
    change.rows = std::move(rows);
    return change;
  }
  const std::vector<size_t> places = FindPlaces(before, now);
  std::vector<size_t> own(places.size());
  for (size_t i = 0; i < own.size(); ++i) own[i] = i;
  std::map<TrialName, Trial> meant;
  for (Trial& trial : ListTrials(now)) {
    TrialName name = NameTrial(now, trial, own);
    meant.emplace(std::move(name), std::move(trial));  // of two that are the same the first is made
  }
  long aside = 0;
  for (TrialRow& row : rows) {
    const bool was_meant = row.trial.number >= 0;
    const auto found = meant.find(NameTrial(before, row.trial, places));
    if (found == meant.end()) {
      if (was_meant) ++change.set_aside;
      // Its values by the keys' order now; a text that is not a value any more cannot be kept.
      std::vector<double> parameters;
      for (size_t i = 0; i < places.size(); ++i) {
        const std::string value = FormatValue(before.variations[places[i]], row.trial.parameters[places[i]]);
        const std::vector<std::string>& labels = now.variations[i].labels;
        const auto label = std::find(labels.begin(), labels.end(), value);
        if (labels.empty() && before.variations[places[i]].labels.empty()) {
          parameters.push_back(row.trial.parameters[places[i]]);
        } else if (label != labels.end()) {
          parameters.push_back(static_cast<double>(label - labels.begin()));
        }
      }
      if (parameters.size() < places.size()) continue;
      row.trial.parameters = parameters;
      row.trial.number = --aside;
    } else {
      ++(was_meant ? change.kept : change.brought_back);
      row.trial = found->second;
      meant.erase(found);
    }
    change.rows.push_back(std::move(row));
  }
  return change;
}

std::string Describe(const StudyChange& change) {
  std::string text = fmt::format("{} trials are kept", change.kept);
  if (change.brought_back > 0) text += fmt::format(", {} are brought back", change.brought_back);
  if (change.set_aside > 0) text += fmt::format(", {} are set aside", change.set_aside);
  return text;
}

}  // namespace dexcheck
