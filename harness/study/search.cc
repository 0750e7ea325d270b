#include "harness/study/search.h"

#include <cmath>

#include "harness/study/margin_search.h"

namespace dexcheck {

UnitPoint MirrorIntoUnit(UnitPoint point) {
  for (double& x : point) {
    const double y = std::fmod(std::abs(x), 2.0);
    x = y > 1.0 ? 2.0 - y : y;
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
  const bool local =
      study.search.method == SearchMethod::kNelderMead || study.search.method == SearchMethod::kBobyqa;
  return local ? MakeLocalSearcher(study.search, start)
               : MakePopulationSearcher(study.search, study.objectives.size(), start);
}

}  // namespace dexcheck
