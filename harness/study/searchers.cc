// Pagmo's algorithms evaluate a generation point by point. None of a generation's points depends on the
// values of another one of it, so that a generation can be had beforehand: a copy of the algorithm runs until
// it has named all its points and is then abandoned by an exception. When the values are known, the algorithm
// itself makes the same generation.

#include <algorithm>
#include <cmath>
#include <nlopt.hpp>
#include <pagmo/algorithms/cmaes.hpp>
#include <pagmo/algorithms/nsga2.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>
#include <variant>

#include "harness/study/search.h"

namespace dexcheck {
namespace {

/// All points of a generation are known.
struct GenerationIsNamed {};

/// What a generation's evaluations are made of.
struct Generation {
  size_t size = 0;
  std::vector<std::vector<double>> points;  ///< Named so far.
  std::vector<std::vector<double>>
      values;  ///< Of the points in their order; empty while they are only to be named.
  size_t next = 0;
};

/// Pagmo's problem: a generation, and no function.
struct GenerationProblem {
  std::shared_ptr<Generation> generation = std::make_shared<Generation>();
  size_t dimensions = 1;
  size_t objectives = 1;

  [[nodiscard]] std::vector<double> fitness(const std::vector<double>& x) const {
    if (!generation->values.empty()) return generation->values.at(generation->next++);
    generation->points.push_back(x);
    if (generation->points.size() == generation->size) throw GenerationIsNamed();
    return std::vector<double>(objectives, 0.0);
  }
  [[nodiscard]] std::pair<std::vector<double>, std::vector<double>> get_bounds() const {
    return {std::vector<double>(dimensions, 0.0), std::vector<double>(dimensions, 1.0)};
  }
  [[nodiscard]] std::vector<double>::size_type get_nobj() const { return objectives; }
};

class PopulationSearcher : public Searcher {
 public:
  PopulationSearcher(const Search& search, size_t objectives, const UnitPoint& start)
      : problem_{std::make_shared<Generation>(), start.size(), objectives},
        population_(pagmo::problem(problem_), 0U, static_cast<unsigned>(search.seed)),
        first_(MakeLatinHypercube(static_cast<int>(start.size()), search.population, search.seed)) {
    first_.front() = start;
    problem_.generation->size = first_.size();
    const auto seed = static_cast<unsigned>(search.seed);
    // One generation at a time, that never ends by itself; CMA-ES keeps what it has learnt.
    constexpr double kAutomatic = -1.0;
    constexpr double kNever = 0.0;
    if (search.method == SearchMethod::kCmaEs) {
      algorithm_.emplace<pagmo::cmaes>(1U, kAutomatic, kAutomatic, kAutomatic, kAutomatic, search.step,
                                       kNever, kNever,
                                       /*memory=*/true, /*force_bounds=*/false, seed);
    } else {
      // Deb's own settings: crossover 0.9 with index 15, mutation of one key in a point with index 20.
      constexpr double kCrossover = 0.9;
      constexpr double kCrossoverIndex = 15.0;
      constexpr double kMutationIndex = 20.0;
      algorithm_.emplace<pagmo::nsga2>(1U, kCrossover, kCrossoverIndex,
                                       1.0 / static_cast<double>(start.size()), kMutationIndex, seed);
    }
  }

  std::vector<UnitPoint> Ask() override {
    if (!is_begun_) return first_;
    Generation& generation = *problem_.generation;
    generation.points.clear();
    generation.values.clear();
    try {
      auto copy = algorithm_;
      std::visit([&](const auto& algorithm) { static_cast<void>(algorithm.evolve(population_)); }, copy);
    } catch (const GenerationIsNamed&) {
    }
    std::vector<UnitPoint> queried = generation.points;
    for (UnitPoint& point : queried) point = MirrorIntoUnit(std::move(point));
    return queried;
  }

  void Tell(const std::vector<Judgement>& judgements) override {
    std::vector<std::vector<double>> values;
    for (const Judgement& judgement : judgements) {
      values.emplace_back();
      for (size_t i = 0; i < judgement.objectives.size(); ++i)
        values.back().push_back(CalcPenalised(judgement, i));
    }
    if (!is_begun_) {
      for (size_t i = 0; i < first_.size(); ++i) population_.push_back(first_[i], values[i]);
      is_begun_ = true;
      return;
    }
    Generation& generation = *problem_.generation;
    generation.values = std::move(values);
    generation.next = 0;
    population_ =
        std::visit([&](const auto& algorithm) { return algorithm.evolve(population_); }, algorithm_);
  }

 private:
  GenerationProblem problem_;
  pagmo::population population_;
  std::vector<UnitPoint> first_;
  std::variant<pagmo::cmaes, pagmo::nsga2> algorithm_;
  bool is_begun_ = false;
};

}  // namespace

std::unique_ptr<Searcher> MakePopulationSearcher(const Search& search, size_t num_objectives,
                                                 const UnitPoint& start) {
  return std::make_unique<PopulationSearcher>(search, num_objectives, start);
}

namespace {

// NLopt calls the function itself and cannot be stopped in between. So each question begins it anew: it is
// given the values that are known, and at the first point without one they are stopped. That takes n^2 calls
// for n points, which costs nothing beside n trials.

/// One local search.
struct Descent {
  UnitPoint start;
  std::vector<double> values;  ///< Of the points that were tried.
  bool is_over = false;
};

/// What one call of NLopt's function needs.
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

class LocalSearcher : public Searcher {
 public:
  LocalSearcher(const Search& search, const UnitPoint& start) : search_(search) {
    const auto dimensions = static_cast<int>(start.size());
    for (UnitPoint& point : MakeLatinHypercube(dimensions, search.starts, search.seed)) {
      descents_.push_back({std::move(point), {}, false});
    }
    descents_.front().start = start;
  }

  std::vector<UnitPoint> Ask() override {
    queried_.clear();
    std::vector<UnitPoint> points;
    for (Descent& descent : descents_) {
      if (descent.is_over) continue;
      const UnitPoint point = FindNext(descent);
      descent.is_over = point.empty();
      if (descent.is_over) continue;
      queried_.push_back(&descent);
      points.push_back(point);
    }
    return points;
  }

  void Tell(const std::vector<Judgement>& judgements) override {
    for (size_t i = 0; i < judgements.size(); ++i) {
      Descent& descent = *queried_[i];
      descent.values.push_back(FindValue(descent, judgements[i]));
    }
  }

 private:
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

}  // namespace

std::unique_ptr<Searcher> MakeLocalSearcher(const Search& search, const UnitPoint& start) {
  return std::make_unique<LocalSearcher>(search, start);
}

}  // namespace dexcheck
