// Pagmo's algorithms evaluate a generation point by point. None of a generation's points depends on the
// values of another one of it, so that a generation can be had beforehand: a copy of the algorithm runs until
// it has named all its points and is then abandoned by an exception. When the values are known, the algorithm
// itself makes the same generation.

#include <algorithm>
#include <cmath>
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

}  // namespace dexcheck
