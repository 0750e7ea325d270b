#include "harness/study/study_answer.h"

#include <fmt/format.h>

#include <algorithm>

namespace dexcheck {
namespace {

std::string CountPoints(size_t count) { return fmt::format("{} point{}", count, count == 1 ? "" : "s"); }

std::string DescribeBest(const Study& study, const std::vector<JudgedPoint>& points,
                         const JudgedPoint& best) {
  const Objective& objective = study.objectives.front();
  const auto value = [&](const JudgedPoint& point) {
    return ShowObjective(objective, point.judgement.objectives.front());
  };
  std::string text =
      fmt::format("The {} {} of {} is {:.4g}, at {} (trial {}).", objective.maximize ? "largest" : "least",
                  Describe(objective), CountPoints(points.size()), value(best),
                  DescribeValues(study, best.values), best.number * CountTrialsOfPoint(study));
  const JudgedPoint& first = points.front();
  if (study.is_search() && first.number == 0 && first.number != best.number) {
    text += first.judgement.is_feasible() ? fmt::format(" The search began with {:.4g}.", value(first))
                                          : " The search began where a constraint does not hold.";
  }
  return text;
}

std::string DescribeFront(const Study& study, const std::vector<JudgedPoint>& points) {
  const std::vector<const JudgedPoint*> front = FindFront(points);
  std::string text =
      fmt::format("Of {}, {} that no other one beats in everything:", CountPoints(points.size()),
                  front.size() == 1 ? "there is 1" : fmt::format("there are {}", front.size()));
  for (size_t i = 0; i < study.objectives.size(); ++i) {
    const auto [least, most] =
        std::minmax_element(front.begin(), front.end(), [&](const JudgedPoint* a, const JudgedPoint* b) {
          return a->judgement.objectives[i] < b->judgement.objectives[i];
        });
    const auto show = [&](const JudgedPoint* point) {
      return ShowObjective(study.objectives[i], point->judgement.objectives[i]);
    };
    text += fmt::format("{} {} from {:.4g} ({}) to {:.4g}", i == 0 ? "" : ";", Describe(study.objectives[i]),
                        show(*least), DescribeValues(study, (*least)->values), show(*most));
  }
  return text + ".";
}

}  // namespace

std::string DescribeValues(const Study& study, const std::vector<double>& values) {
  std::string text;
  for (size_t i = 0; i < values.size(); ++i) {
    const Variation& variation = study.variations[i];
    text += fmt::format(
        "{}{} = {}", i == 0 ? "" : ", ", variation.key,
        variation.labels.empty() ? fmt::format("{:.6g}", values[i]) : FormatValue(variation, values[i]));
  }
  return text;
}

double ShowObjective(const Objective& objective, double value) { return objective.maximize ? -value : value; }

std::vector<std::string> AnswerStudy(const Study& study, const std::vector<TrialRow>& rows) {
  std::vector<std::string> answers;
  if (study.objectives.empty()) return answers;
  const std::vector<JudgedPoint> points = JudgePoints(study, rows);
  if (points.empty()) return answers;
  const JudgedPoint* const best = FindBest(points);
  if (best == nullptr) {
    answers.push_back(fmt::format("At none of {} all constraints hold.", CountPoints(points.size())));
  } else {
    answers.push_back(study.objectives.size() == 1 ? DescribeBest(study, points, *best)
                                                   : DescribeFront(study, points));
  }
  return answers;
}

}  // namespace dexcheck
