#include "harness/study/halving_search.h"

#include <algorithm>
#include <numeric>

namespace dexcheck {

HalvingSearcher::HalvingSearcher(const Search& search, const UnitPoint& start)
    : search_(search),
      points_(MakeLatinHypercube(static_cast<int>(start.size()), search.population, search.seed)) {
  points_.front() = start;
}

void HalvingSearcher::Tell(const std::vector<Judgement>& judgements) {
  std::vector<size_t> order(points_.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return IsBetter(judgements[a], judgements[b]); });
  ++round_;
  const std::vector<long> counts = CountPointsOfRounds(search_);
  std::vector<UnitPoint> better;
  for (size_t i = 0; round_ < counts.size() && i < static_cast<size_t>(counts[round_]); ++i)
    better.push_back(points_[order[i]]);
  points_ = std::move(better);
}

std::vector<long> CountPointsOfRounds(const Search& search) {
  std::vector<long> counts;
  long count = search.population;
  for (size_t round = 0; round < search.durations.size(); ++round) {
    counts.push_back(count);
    count = std::max(count / search.keep, 1L);
  }
  return counts;
}

size_t FindRound(const Search& search, long point) {
  size_t round = 0;
  for (const long count : CountPointsOfRounds(search)) {
    if (point < count) return round;
    point -= count;
    ++round;
  }
  return 0;
}

bool IsShortened(const Search& search, long point) {
  return !search.durations.empty() && FindRound(search, point) + 1 < search.durations.size();
}

}  // namespace dexcheck
