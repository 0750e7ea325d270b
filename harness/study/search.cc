#include "harness/study/search.h"

#include <algorithm>
#include <cmath>

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

}  // namespace dexcheck
