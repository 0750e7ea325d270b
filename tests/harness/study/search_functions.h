#pragma once

// Searches on functions whose best points are known.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "harness/study/search.h"

namespace dexcheck::testing {

using Function = std::function<std::vector<double>(const UnitPoint&)>;

inline Search MakeSearch(SearchMethod method, long count) {
  Search search;
  search.method = method;
  search.count = count;
  search.population = 16;
  search.seed = 3;
  return search;
}

inline std::unique_ptr<Searcher> Make(const Search& search, size_t objectives, const UnitPoint& start) {
  Study study;
  study.search = search;
  study.objectives.resize(objectives);
  return MakeSearcher(study, start);
}

/// Values of all points that a search asks within its count, in their order.
inline std::vector<JudgedPoint> RunSearch(const Search& search, const UnitPoint& start,
                                          const Function& function) {
  const auto searcher = Make(search, function(start).size(), start);
  std::vector<JudgedPoint> points;
  while (static_cast<long>(points.size()) < search.count) {
    const std::vector<UnitPoint> batch = searcher->Ask();
    if (batch.empty()) break;
    std::vector<Judgement> judgements;
    for (const UnitPoint& point : batch) {
      for (const double x : point) {
        EXPECT_GE(x, 0.0);
        EXPECT_LE(x, 1.0);
      }
      judgements.push_back({function(point), 0.0});
      points.push_back({static_cast<long>(points.size()), point, judgements.back()});
    }
    searcher->Tell(judgements);
  }
  return points;
}

/// Zitzler, Deb and Thiele's first problem with 4 keys: the front is f2 = 1 - sqrt(f1).
inline std::vector<double> Zdt1(const UnitPoint& x) {
  const double g = 1.0 + 3.0 * (x[1] + x[2] + x[3]);
  return {x[0], g * (1.0 - std::sqrt(x[0] / g))};
}

/// Area between a front and the point (1.1, 1.1).
inline double CalcHypervolume(const std::vector<const JudgedPoint*>& front) {
  double volume = 0.0;
  double height = 1.1;
  for (const JudgedPoint* point : front) {
    const double x = point->judgement.objectives[0];
    const double y = point->judgement.objectives[1];
    if (x >= 1.1 || y >= height) continue;
    volume += (1.1 - x) * (height - y);
    height = y;
  }
  return volume;
}

}  // namespace dexcheck::testing
