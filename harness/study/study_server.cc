#include "harness/study/study_server.h"

#include <algorithm>
#include <istream>
#include <nlohmann/json.hpp>
#include <ostream>
#include <stdexcept>
#include <string>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/study/study_answer.h"

namespace dexcheck {
namespace {

using Json = nlohmann::ordered_json;

double ReadValue(const Variation& variation, const Json& value) {
  if (!variation.labels.empty()) {
    const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
    const auto found = std::find(variation.labels.begin(), variation.labels.end(), text);
    if (found == variation.labels.end())
      throw std::invalid_argument(variation.key + ": has no value " + Quote(text));
    return static_cast<double>(found - variation.labels.begin());
  }
  if (!value.is_number())
    throw std::invalid_argument(variation.key + ": must be a number, got " + Quote(value.dump()));
  const auto number = value.get<double>();
  if (!(variation.from <= number && number <= variation.to)) {
    throw std::invalid_argument(variation.key + ": must be from " + FormatNumber(variation.from) + " to " +
                                FormatNumber(variation.to) + ", got " + FormatNumber(number));
  }
  return number;
}

std::vector<std::vector<double>> ReadPoints(const Study& study, const std::string& line) {
  const Json list = Json::parse(line, nullptr, /*allow_exceptions=*/false);
  if (!list.is_array()) throw std::invalid_argument("must be a JSON list of points, got " + Quote(line));
  std::vector<std::vector<double>> points;
  for (const Json& entry : list) {
    if (!entry.is_array() || entry.size() != study.num_keys()) {
      throw std::invalid_argument("a point must have a value for each of the " +
                                  std::to_string(study.num_keys()) + " keys, got " + Quote(entry.dump()));
    }
    points.emplace_back();
    for (size_t i = 0; i < study.num_keys(); ++i)
      points.back().push_back(ReadValue(study.variations[i], entry[i]));
  }
  return points;
}

/// @param rows of all trials of one point.
Json Answer(const Study& study, long number, const std::vector<TrialRow>& rows) {
  std::vector<TrialResult> results;
  Json answer = {{"point", number}, {"trials", Json::array()}, {"objectives", Json::array()}};
  for (const TrialRow& row : rows) {
    results.push_back(row.result);
    answer["trials"].push_back(row.trial.number);
  }
  const Judgement judgement = JudgePoint(study.objectives, study.constraints, results);
  for (size_t i = 0; i < study.objectives.size(); ++i) {
    answer["objectives"].push_back(
        ShowObjective(study.objectives[i], judgement.objectives[i]));  // null where infinite
  }
  answer["violation"] = judgement.violation;
  answer["feasible"] = judgement.is_feasible();
  for (const TrialRow& row : rows) answer["outcomes"].push_back(NameOf(row.result.outcome));
  return answer;
}

}  // namespace

void ServePoints(const StudyInputs& inputs, const RunOptions& options, StudyStore* store, std::istream& in,
                 std::ostream& out) {
  const Study& study = inputs.study;
  const std::vector<std::vector<double>> draws = ListDraws(study);
  long number = 0;
  for (std::string line; !options.is_interrupted() && std::getline(in, line);) {
    std::vector<std::vector<double>> points;
    try {
      points = ReadPoints(study, line);
      if (number + static_cast<long>(points.size()) > study.search.count) {
        throw std::invalid_argument("the study has at most " + std::to_string(study.search.count) +
                                    " points");
      }
    } catch (const std::invalid_argument& error) {
      out << Json{{"error", error.what()}}.dump() << std::endl;
      continue;
    }
    std::vector<std::vector<Trial>> trials;
    std::vector<Trial> all;
    for (const std::vector<double>& point : points) {
      trials.push_back(ListTrialsOfPoint(study, number + static_cast<long>(trials.size()), point, draws));
      all.insert(all.end(), trials.back().begin(), trials.back().end());
    }
    RunTrials(inputs, all, options, store);
    Json answers = Json::array();
    for (const std::vector<Trial>& of_point : trials) {
      std::vector<TrialRow> rows;
      for (const Trial& trial : of_point) {
        const auto row = store->FindRow(trial.number);
        if (!row) return;  // interrupted
        if (row->trial.parameters != trial.parameters) {
          throw InputError(study.source + ": trial " + std::to_string(trial.number) +
                           " of the database is of another point than the one that was asked for");
        }
        rows.push_back(*row);
      }
      answers.push_back(Answer(study, number++, rows));
    }
    out << answers.dump() << std::endl;
  }
}

}  // namespace dexcheck
