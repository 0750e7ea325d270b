#include "harness/study/search.h"

#include <algorithm>

#include "controller/common/errors.h"

namespace dexcheck {
namespace {

/// The begin of a search, as `[search] start` says.
UnitPoint FindStart(const Study& study) {
  const std::vector<double>& values = study.search.start_values;
  UnitPoint start(study.variations.size(), 0.5);
  for (size_t i = 0; i < values.size(); ++i) start[i] = FractionOf(study.variations[i], values[i]);
  return start;
}

template <typename IsBefore>
std::vector<const JudgedPoint*> SortFeasibleBy(const std::vector<JudgedPoint>& points, IsBefore is_before) {
  std::vector<const JudgedPoint*> sorted;
  for (const JudgedPoint& point : points) {
    if (point.judgement.is_feasible()) sorted.push_back(&point);
  }
  std::ranges::stable_sort(sorted, [&](const JudgedPoint* a, const JudgedPoint* b) {
    return is_before(a->judgement, b->judgement);
  });
  return sorted;
}

}  // namespace

SearchHistory::SearchHistory(const Study& study)
    : study_(study), searcher_(MakeSearcher(study.search, FindStart(study))) {
  AskNext();
}

long SearchHistory::first_of_batch() const {
  return static_cast<long>(points_.size()) * CountTrialsOfPoint(study_);
}

long SearchHistory::CountDone() const {
  const long of_batch = static_cast<long>(batch_.size()) * CountTrialsOfPoint(study_);
  return first_of_batch() + of_batch - static_cast<long>(ListMissing().size());
}

void SearchHistory::AskNext() {
  batch_.clear();
  for (const UnitPoint& point : searcher_->Ask()) {
    if (static_cast<long>(points_.size() + batch_.size()) == study_.search.count) break;
    batch_.push_back(ValuesAt(study_.variations, point));
  }
}

void SearchHistory::Add(const TrialRow& row) {
  if (row.trial.number < first_of_batch()) return;
  rows_.insert_or_assign(row.trial.number, row);
  ObserveWhatIsDone();
}

void SearchHistory::ObserveWhatIsDone() {
  // A batch that the limit cut short is not judged: the search is over.
  while (!batch_.empty()) {
    std::vector<JudgedPoint> judged;
    for (const std::vector<double>& values : batch_) {
      const long number = static_cast<long>(points_.size() + judged.size());
      std::vector<TrialResult> results;
      for (const Trial& trial : ListTrialsOfPoint(study_, number, values)) {
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
    searcher_->Observe(judgements);
    AskNext();
  }
}

std::vector<Trial> SearchHistory::ListMissing() const {
  std::vector<Trial> missing;
  long number = static_cast<long>(points_.size());
  for (const std::vector<double>& values : batch_) {
    for (Trial& trial : ListTrialsOfPoint(study_, number, values)) {
      if (rows_.count(trial.number) == 0) missing.push_back(std::move(trial));
    }
    ++number;
  }
  return missing;
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
    points.push_back({number, values, JudgePoint(study.objectives, study.constraints, results)});
  }
  return points;
}

std::vector<const JudgedPoint*> SortFeasible(const std::vector<JudgedPoint>& points) {
  return SortFeasibleBy(points, IsBetter);
}

std::vector<const JudgedPoint*> FindFront(const std::vector<JudgedPoint>& points) {
  const std::vector<const JudgedPoint*> sorted = SortFeasibleBy(
      points, [](const Judgement& a, const Judgement& b) { return a.objectives < b.objectives; });
  // In this order only a point before another one can dominate it.
  std::vector<const JudgedPoint*> front;
  for (const JudgedPoint* point : sorted) {
    const bool dominated = std::ranges::any_of(
        front, [&](const JudgedPoint* other) { return Dominates(other->judgement, point->judgement); });
    if (!dominated) front.push_back(point);
  }
  return front;
}

}  // namespace dexcheck
