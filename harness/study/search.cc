#include "harness/study/search.h"

#include <algorithm>
#include <cmath>

#include "controller/common/errors.h"
#include "harness/study/margin_search.h"

namespace dexcheck {

// The mirrors stand a little outside, so that a best point on the edge is found exactly.
UnitPoint MirrorIntoUnit(UnitPoint point) {
  constexpr double kEdge = 0.1;                  // so far outside a point counts as one on the edge
  constexpr double kPeriod = 1.0 + 2.0 * kEdge;  // from mirror to mirror
  for (double& x : point) {
    const double y = std::fmod(std::abs(x + kEdge), 2.0 * kPeriod);
    x = std::clamp((y > kPeriod ? 2.0 * kPeriod - y : y) - kEdge, 0.0, 1.0);
  }
  return point;
}

double CalcPenalised(const Judgement& judgement, size_t objective) {
  // More than any objective, and still in the order of the violations.
  constexpr double kInfeasible = 1e100;
  return judgement.is_feasible() ? judgement.objectives.at(objective)
                                 : kInfeasible * (1.0 + judgement.violation);
}

std::unique_ptr<Searcher> MakeSearcher(const Study& study, const UnitPoint& start) {
  if (study.search.method == SearchMethod::kMargins)
    return std::make_unique<MarginSearcher>(study.search, start);
  return study.search.method == SearchMethod::kNelderMead
             ? MakeLocalSearcher(study.search, start)
             : MakePopulationSearcher(study.search, study.objectives.size(), start);
}

SearchHistory::SearchHistory(const Study& study, const UnitPoint& start)
    : study_(study),
      per_point_(CountTrialsOfPoint(study)),
      draws_(ListDraws(study)),
      searcher_(MakeSearcher(study, start)) {
  AskNext();
}

long SearchHistory::first_of_batch() const { return static_cast<long>(points_.size()) * per_point_; }

long SearchHistory::CountDone() const {
  return first_of_batch() + size_of_batch() - static_cast<long>(ListMissing().size());
}

void SearchHistory::AskNext() {
  batch_.clear();
  for (const UnitPoint& point : searcher_->Ask()) {
    if (static_cast<long>(points_.size() + batch_.size()) == study_.search.count) break;
    batch_.push_back(ValuesAt(study_.keys(), point));
  }
}

void SearchHistory::Add(const TrialRow& row) {
  if (row.trial.number < first_of_batch()) return;
  rows_.insert_or_assign(row.trial.number, row);
  TellWhatIsDone();
}

void SearchHistory::TellWhatIsDone() {
  // A batch that the limit cut short is not judged: the search is over.
  while (!batch_.empty()) {
    std::vector<JudgedPoint> judged;
    for (const std::vector<double>& values : batch_) {
      const long number = static_cast<long>(points_.size() + judged.size());
      std::vector<TrialResult> results;
      for (const Trial& trial : ListTrialsOfPoint(study_, number, values, draws_)) {
        const auto row = rows_.find(trial.number);
        if (row == rows_.end()) return;
        if (row->second.trial.parameters != trial.parameters || row->second.trial.seed != trial.seed) {
          throw InputError(study_.source + ": trial " + std::to_string(trial.number) +
                           " is not what this search makes of the trials before it");
        }
        results.push_back(row->second.result);
      }
      judged.push_back({number, values, JudgePoint(study_.objectives, study_.constraints, results)});
    }
    std::vector<Judgement> judgements;
    for (JudgedPoint& point : judged) {
      judgements.push_back(point.judgement);
      points_.push_back(std::move(point));
    }
    rows_.erase(rows_.begin(), rows_.lower_bound(first_of_batch()));
    if (static_cast<long>(points_.size()) >= study_.search.count) {
      batch_.clear();
      return;
    }
    searcher_->Tell(judgements);
    AskNext();
  }
}

std::vector<Trial> SearchHistory::ListMissing() const {
  std::vector<Trial> missing;
  long number = static_cast<long>(points_.size());
  for (const std::vector<double>& values : batch_) {
    for (Trial& trial : ListTrialsOfPoint(study_, number, values, draws_)) {
      if (rows_.count(trial.number) == 0) missing.push_back(std::move(trial));
    }
    ++number;
  }
  return missing;
}

UnitPoint FindSearchStart(const Study& study) {
  if (study.search.start_values.empty()) return UnitPoint(study.num_keys(), 0.5);
  return FractionsOf(study.keys(), study.search.start_values);
}

std::vector<JudgedPoint> JudgePoints(const Study& study, const std::vector<TrialRow>& rows) {
  const long per_point = CountTrialsOfPoint(study);
  std::vector<JudgedPoint> points;
  std::vector<TrialResult> results;
  for (size_t i = 0; i < rows.size();) {
    const long number = rows[i].trial.number / per_point;
    results.clear();
    const std::vector<double>& values = rows[i].trial.parameters;
    for (; i < rows.size() && rows[i].trial.number / per_point == number; ++i)
      results.push_back(rows[i].result);
    if (static_cast<long>(results.size()) < per_point) continue;
    points.push_back({number,
                      {values.begin(), values.begin() + static_cast<std::ptrdiff_t>(study.num_keys())},
                      JudgePoint(study.objectives, study.constraints, results)});
  }
  return points;
}

namespace {

template <typename IsBefore>
std::vector<const JudgedPoint*> SortFeasibleBy(const std::vector<JudgedPoint>& points, IsBefore is_before) {
  std::vector<const JudgedPoint*> sorted;
  for (const JudgedPoint& point : points) {
    if (point.judgement.is_feasible()) sorted.push_back(&point);
  }
  std::stable_sort(sorted.begin(), sorted.end(), [&](const JudgedPoint* a, const JudgedPoint* b) {
    return is_before(a->judgement, b->judgement);
  });
  return sorted;
}

}  // namespace

std::vector<const JudgedPoint*> SortFeasible(const std::vector<JudgedPoint>& points) {
  return SortFeasibleBy(points, IsBetter);
}

std::vector<const JudgedPoint*> FindFront(const std::vector<JudgedPoint>& points) {
  const std::vector<const JudgedPoint*> sorted = SortFeasibleBy(
      points, [](const Judgement& a, const Judgement& b) { return a.objectives < b.objectives; });
  // In this order only a point before another one can dominate it.
  std::vector<const JudgedPoint*> front;
  for (const JudgedPoint* point : sorted) {
    const bool dominated = std::any_of(front.begin(), front.end(), [&](const JudgedPoint* other) {
      return Dominates(other->judgement, point->judgement);
    });
    if (!dominated) front.push_back(point);
  }
  return front;
}

}  // namespace dexcheck
