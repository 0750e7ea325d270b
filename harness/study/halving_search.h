#pragma once

// Successive halving over the duration of trials.

#include "harness/study/search.h"

namespace dexcheck {

/// Tries many points for a short time, the better ones of them for longer, the best to the end: round r has
/// the `1 / keep` best points of the round before it, each a trial of durations[r] from its beginning.
class HalvingSearcher : public Searcher {
 public:
  /// The first round is a Latin hypercube, with the start in the place of its first point.
  HalvingSearcher(const Search& search, const UnitPoint& start);

  std::vector<UnitPoint> Ask() override { return points_; }
  void Tell(const std::vector<Judgement>& judgements) override;

 private:
  Search search_;
  size_t round_ = 0;
  std::vector<UnitPoint> points_;
};

/// Points of each round: population, population / keep, ..., at least 1.
std::vector<long> CountPointsOfRounds(const Search& search);

/// The round that a point belongs to; 0 for other searches.
size_t FindRound(const Search& search, long point);

/// Whether a point was tried for less than the whole duration.
bool IsShortened(const Search& search, long point);

}  // namespace dexcheck
