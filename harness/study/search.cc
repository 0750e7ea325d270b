#include "harness/study/search.h"

#include <algorithm>
#include <cmath>
#include <nlopt.hpp>
#include <pagmo/algorithms/cmaes.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>

#include "controller/common/errors.h"

namespace dexcheck {
namespace {

/// Into [0, 1], as by mirrors at both ends: an algorithm that knows no bounds sees a continuous function. The
/// mirrors stand a little outside, so that a best point on the edge is found exactly.
UnitPoint MirrorIntoUnit(UnitPoint point) {
  constexpr double kEdge = 0.1;                  // so far outside a point counts as one on the edge
  constexpr double kPeriod = 1.0 + 2.0 * kEdge;  // from mirror to mirror
  for (double& x : point) {
    const double y = std::fmod(std::abs(x + kEdge), 2.0 * kPeriod);
    x = std::clamp((y > kPeriod ? 2.0 * kPeriod - y : y) - kEdge, 0.0, 1.0);
  }
  return point;
}

/// A number that orders judgements as IsBetter does: the objective where it is feasible, else more than any
/// objective.
double CalcPenalised(const Judgement& judgement) {
  // More than any objective, and still in the order of the violations.
  constexpr double kInfeasible = 1e100;
  return judgement.is_feasible() ? judgement.objectives.front() : kInfeasible * (1.0 + judgement.violation);
}

// Pagmo's CMA-ES evaluates a generation point by point. None of a generation's points depends on the values
// of another one of it, so that a generation can be had beforehand: a copy of the algorithm runs until it has
// named all its points and is then abandoned by an exception. When the values are known, the algorithm itself
// makes the same generation.

/// All points of a generation are known.
struct GenerationIsNamed {};

/// Evaluations of a generation.
struct Generation {
  size_t size = 0;
  std::vector<UnitPoint> points;            ///< Named so far.
  std::vector<std::vector<double>> values;  ///< Of the points; empty while they are only to be named.
  size_t next = 0;
};

/// Pagmo's problem: a generation, and no function.
struct GenerationProblem {
  std::shared_ptr<Generation> generation = std::make_shared<Generation>();
  size_t dimensions = 1;

  [[nodiscard]] std::vector<double> fitness(const std::vector<double>& x) const {
    if (!generation->values.empty()) return generation->values.at(generation->next++);
    generation->points.push_back(x);
    if (generation->points.size() == generation->size) throw GenerationIsNamed();
    return {0.0};
  }
  [[nodiscard]] std::pair<std::vector<double>, std::vector<double>> get_bounds() const {
    return {std::vector<double>(dimensions, 0.0), std::vector<double>(dimensions, 1.0)};
  }
};

// One generation at a time, that never ends by itself; what was learnt is kept.
constexpr double kAutomatic = -1.0;
constexpr double kNever = 0.0;

class CmaEsSearcher : public Searcher {
 public:
  CmaEsSearcher(const Search& search, const UnitPoint& start)
      : problem_{std::make_shared<Generation>(), start.size()},
        population_(pagmo::problem(problem_), 0U, static_cast<unsigned>(search.seed)),
        first_(MakeLatinHypercube(static_cast<int>(start.size()), search.population, search.seed)),
        algorithm_(1U, kAutomatic, kAutomatic, kAutomatic, kAutomatic, search.step, kNever, kNever,
                   /*memory=*/true, /*force_bounds=*/false, static_cast<unsigned>(search.seed)) {
    first_.front() = start;
    problem_.generation->size = first_.size();
  }

  std::vector<UnitPoint> Ask() override {
    if (population_.size() == 0) return first_;
    *problem_.generation = {.size = first_.size()};
    try {
      const pagmo::cmaes copy = algorithm_;
      static_cast<void>(copy.evolve(population_));
    } catch (const GenerationIsNamed&) {
    }
    std::vector<UnitPoint> queried = problem_.generation->points;
    for (UnitPoint& point : queried) point = MirrorIntoUnit(std::move(point));
    return queried;
  }

  void Observe(const std::vector<Judgement>& judgements) override {
    std::vector<std::vector<double>> values;
    for (const Judgement& judgement : judgements) values.push_back({CalcPenalised(judgement)});
    if (population_.size() == 0) {
      for (size_t i = 0; i < first_.size(); ++i) population_.push_back(first_[i], values[i]);
      return;
    }
    problem_.generation->values = std::move(values);
    population_ = algorithm_.evolve(population_);
  }

 private:
  GenerationProblem problem_;
  pagmo::population population_;
  std::vector<UnitPoint> first_;
  pagmo::cmaes algorithm_;
};

// NLopt calls the function itself and cannot be stopped in between. So each question begins it anew: it is
// given the values that are known, and at the first point without one they are stopped. That takes n^2 calls
// for n points, which costs nothing beside n trials.

/// One local search.
struct Descent {
  UnitPoint start;
  std::vector<double> values;  ///< Of the points that were tried.
};

/// State of one call of NLopt's function.
struct Replay {
  const Descent* descent;
  size_t next = 0;
  UnitPoint queried;  ///< Empty until a point without a value comes.
};

double Evaluate(const std::vector<double>& x, std::vector<double>& /*gradient*/, void* data) {
  Replay& replay = *static_cast<Replay*>(data);
  if (replay.next < replay.descent->values.size()) return replay.descent->values[replay.next++];
  replay.queried = x;
  throw nlopt::forced_stop();
}

class NelderMeadSearcher : public Searcher {
 public:
  NelderMeadSearcher(const Search& search, const UnitPoint& start) : search_(search) {
    const auto dimensions = static_cast<int>(start.size());
    for (UnitPoint& point : MakeLatinHypercube(dimensions, search.starts, search.seed)) {
      descents_.push_back({std::move(point), {}});
    }
    descents_.front().start = start;
  }

  std::vector<UnitPoint> Ask() override {
    queried_.clear();
    std::vector<UnitPoint> points;
    for (Descent& descent : descents_) {
      const UnitPoint point = FindNext(descent);
      if (point.empty()) continue;
      queried_.push_back(&descent);
      points.push_back(point);
    }
    return points;
  }

  void Observe(const std::vector<Judgement>& judgements) override {
    for (size_t i = 0; i < judgements.size(); ++i) {
      Descent& descent = *queried_[i];
      descent.values.push_back(FindValue(descent, judgements[i]));
    }
  }

 private:
  /// Empty when the search is over.
  [[nodiscard]] UnitPoint FindNext(const Descent& descent) const {
    nlopt::opt method(nlopt::LN_NELDERMEAD, static_cast<unsigned>(descent.start.size()));
    Replay replay{&descent, 0, {}};
    method.set_min_objective(Evaluate, &replay);
    // Without bounds, for a simplex would lie down flat on one and stay there; MirrorIntoUnit serves instead.
    method.set_initial_step(search_.step);
    method.set_xtol_abs(search_.tolerance);
    std::vector<double> x = descent.start;
    double value = 0.0;
    try {
      method.optimize(x, value);
    } catch (const nlopt::forced_stop&) {
    } catch (const nlopt::roundoff_limited&) {  // as near as it gets
    }
    return MirrorIntoUnit(replay.queried);
  }

  /// A feasible point's objective; else a little worse than all that this search has seen.
  static double FindValue(const Descent& descent, const Judgement& judgement) {
    if (judgement.is_feasible() || descent.values.empty()) return CalcPenalised(judgement);
    const double worst = *std::ranges::max_element(descent.values);
    return worst + std::max(std::abs(worst), 1e-300) * 0.01 * judgement.violation;
  }

  Search search_;
  std::vector<Descent> descents_;
  std::vector<Descent*> queried_;
};

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

std::unique_ptr<Searcher> MakeSearcher(const Search& search, const UnitPoint& start) {
  if (search.method == SearchMethod::kCmaEs) return std::make_unique<CmaEsSearcher>(search, start);
  return std::make_unique<NelderMeadSearcher>(search, start);
}

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
