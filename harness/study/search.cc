#include "harness/study/search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "controller/common/errors.h"

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
  std::ranges::stable_sort(sorted, [&](const JudgedPoint* a, const JudgedPoint* b) {
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
    const bool dominated = std::ranges::any_of(
        front, [&](const JudgedPoint* other) { return Dominates(other->judgement, point->judgement); });
    if (!dominated) front.push_back(point);
  }
  return front;
}

namespace {

/// Even on the sphere, with a generator of our own: the standard leaves its normal distribution open.
UnitPoint MakeDirection(size_t dimensions, std::mt19937_64* random) {
  const auto draw = [&] { return (static_cast<double>((*random)() >> 11U) + 0.5) * 0x1p-53; };
  UnitPoint direction(dimensions);
  double square = 0.0;
  for (double& x : direction) {
    x = std::sqrt(-2.0 * std::log(draw())) * std::cos(2.0 * M_PI * draw());  // Box and Muller
    square += x * x;
  }
  for (double& x : direction) x /= std::sqrt(square);
  return direction;
}

/// How far the unit cube reaches from a point in it.
double FindEnd(const UnitPoint& start, const UnitPoint& direction) {
  double end = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < start.size(); ++i) {
    if (direction[i] > 0.0) end = std::min(end, (1.0 - start[i]) / direction[i]);
    if (direction[i] < 0.0) end = std::min(end, -start[i] / direction[i]);
  }
  return end;
}

}  // namespace

MarginSearcher::MarginSearcher(const Search& search, const UnitPoint& start)
    : tolerance_(search.tolerance), start_(start) {
  const auto add = [&](const UnitPoint& direction) {
    margins_.push_back({direction, start, {}, 0.0, FindEnd(start, direction)});
  };
  for (size_t i = 0; i < start.size(); ++i) {
    for (const double sign : {-1.0, 1.0}) {
      UnitPoint direction(start.size(), 0.0);
      direction[i] = sign;
      add(direction);
    }
  }
  std::mt19937_64 random(search.seed);
  for (long i = 0; i < search.directions; ++i) add(MakeDirection(start.size(), &random));
}

long MarginSearcher::CountPoints(const Search& search, size_t dimensions) {
  // A direction's end is at most the cube's diagonal away.
  const double steps = std::ceil(std::log2(std::sqrt(static_cast<double>(dimensions)) / search.tolerance));
  const long directions = 2 * static_cast<long>(dimensions) + search.directions;
  return 1 + directions * (1 + std::max(static_cast<long>(steps), 0L));
}

UnitPoint MarginSearcher::PointAt(const Margin& margin, double distance) const {
  UnitPoint point = start_;
  for (size_t i = 0; i < point.size(); ++i) {
    point[i] = std::clamp(point[i] + distance * margin.direction[i], 0.0, 1.0);
  }
  return point;
}

bool MarginSearcher::IsOpen(const Margin& margin) const {
  constexpr double kRounding = 1e-9;  // of a start that is given by its values
  return !margin.bad.empty() && margin.at_most - margin.distance > tolerance_ * (1.0 + kRounding);
}

std::vector<UnitPoint> MarginSearcher::Ask() {
  queried_.clear();
  if (phase_ == Phase::kStart) return {start_};
  std::vector<UnitPoint> points;
  for (Margin& margin : margins_) {
    if (phase_ == Phase::kEnds ? !(margin.at_most > 0.0) : !IsOpen(margin)) continue;
    queried_.push_back(&margin);
    points.push_back(
        PointAt(margin, phase_ == Phase::kEnds ? margin.at_most : 0.5 * (margin.distance + margin.at_most)));
  }
  return points;
}

void MarginSearcher::Tell(const std::vector<Judgement>& judgements) {
  if (phase_ == Phase::kStart) {
    phase_ = judgements.front().is_feasible() ? Phase::kEnds : Phase::kOver;
    if (phase_ == Phase::kOver) margins_.clear();
    return;
  }
  for (size_t i = 0; i < queried_.size(); ++i) {
    Margin& margin = *queried_[i];
    const double distance =
        phase_ == Phase::kEnds ? margin.at_most : 0.5 * (margin.distance + margin.at_most);
    const bool good = judgements[i].is_feasible();
    (good ? margin.good : margin.bad) = PointAt(margin, distance);
    (good ? margin.distance : margin.at_most) = distance;
  }
  phase_ = Phase::kBisection;
}

std::vector<Margin> FindMargins(const Study& study, const std::vector<JudgedPoint>& points) {
  if (points.empty()) return {};
  const UnitPoint start = FractionsOf(study.keys(), points[0].values);
  MarginSearcher searcher(study.search, start);
  for (size_t next = 0;;) {
    const size_t count = searcher.Ask().size();
    if (count == 0 || next + count > points.size()) return searcher.margins();
    std::vector<Judgement> judgements;
    for (; judgements.size() < count; ++next) judgements.push_back(points[next].judgement);
    searcher.Tell(judgements);
  }
}

}  // namespace dexcheck
