#pragma once

// Searches with an ask-and-tell interface: which points of the unit cube come next, and what the last ones
// came to.

#include <memory>
#include <vector>

#include "harness/study/objective.h"
#include "harness/study/sampling.h"
#include "harness/study/study.h"

namespace dexcheck {

/// A search. Its next points depend on its settings and on the judgements so far, and on nothing else.
class Searcher {
 public:
  Searcher() = default;
  virtual ~Searcher() = default;
  Searcher(const Searcher&) = delete;
  Searcher& operator=(const Searcher&) = delete;

  /// The points of the next batch, to be tried in any order; none when the search is over.
  [[nodiscard]] virtual std::vector<UnitPoint> Ask() = 0;
  /// What the points of the last batch came to, in its order.
  virtual void Tell(const std::vector<Judgement>& judgements) = 0;
};

/// CMA-ES and NSGA-II of pagmo: a batch is a generation. The first one is a Latin hypercube, with the start
/// in the place of its first point.
std::unique_ptr<Searcher> MakePopulationSearcher(const Search& search, size_t num_objectives,
                                                 const UnitPoint& start);

/// Nelder and Mead's method of NLopt: a batch has a point of each of the local searches. The first
/// begins at the start, the others at points of a Latin hypercube.
std::unique_ptr<Searcher> MakeLocalSearcher(const Search& search, const UnitPoint& start);

/// The search of the study.
std::unique_ptr<Searcher> MakeSearcher(const Study& study, const UnitPoint& start);

/// Into [0, 1], as by mirrors at both ends: an algorithm that knows no bounds sees a continuous function.
UnitPoint MirrorIntoUnit(UnitPoint point);

/// A number that orders judgements of one objective as IsBetter does: the objective where it is feasible,
/// else more than any objective.
double CalcPenalised(const Judgement& judgement, size_t objective = 0);

}  // namespace dexcheck
