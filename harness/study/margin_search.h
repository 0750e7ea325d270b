#pragma once

// How far one may go from a point before a constraint turns.

#include <vector>

#include "harness/study/search.h"

namespace dexcheck {

/// One direction from the start.
struct Margin {
  UnitPoint direction;  ///< Of length 1, in fractions of the ranges.
  UnitPoint good,
      bad;  ///< The two points, both tried, between which it turns; `bad` is empty where it does not.
  double distance = 0.0;  ///< Of `good` from the start, in fractions of the ranges.
  double at_most = 0.0;   ///< Of `bad`, or of the end of the ranges.
};

/// Bisects along both directions of each key and along `search.directions` random ones, all at the same time:
/// a batch has a point of each. It ends when each is known to within `search.tolerance` fractions of the
/// ranges, or at once where the start itself is not feasible. Bisection finds one turn; when there are
/// several, not always the nearest.
class MarginSearcher : public Searcher {
 public:
  MarginSearcher(const Search& search, const UnitPoint& start);

  std::vector<UnitPoint> Ask() override;
  void Tell(const std::vector<Judgement>& judgements) override;

  /// One for each direction, those of the keys first: key 0 down, key 0 up, key 1 down, ...; those that lead
  /// nowhere, because the start lies on the edge, have `at_most` 0. Empty when the start is not feasible.
  [[nodiscard]] const std::vector<Margin>& margins() const { return margins_; }

  /// Points that are tried at most.
  static long CountPoints(const Search& search, size_t dimensions);

 private:
  enum class Phase { kStart, kEnds, kBisection, kOver };
  [[nodiscard]] UnitPoint PointAt(const Margin& margin, double distance) const;
  [[nodiscard]] bool IsOpen(const Margin& margin) const;

  double tolerance_;
  UnitPoint start_;
  Phase phase_ = Phase::kStart;
  std::vector<Margin> margins_;
  std::vector<Margin*> queried_;
};

/// The margins that the points of such a search show, in the order of their numbers.
std::vector<Margin> FindMargins(const Study& study, const std::vector<JudgedPoint>& points);

}  // namespace dexcheck
