#include "harness/study/margin_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace dexcheck {
namespace {

/// Even on the sphere, with a generator of our own: the standard leaves its normal distribution open.
UnitPoint MakeDirection(size_t dimensions, std::mt19937_64* random) {
  const auto draw = [&] { return (static_cast<double>((*random)() >> 11U) + 0.5) * 0x1p-53; };
  UnitPoint direction(dimensions);
  double square = 0.0;
  for (double& x : direction) {
    x = std::sqrt(-2.0 * std::log(draw())) * std::cos(2.0 * M_PI * draw());  // Box and Muller
    square += x * x;
  }
  for (double& x : direction) x /= std::sqrt(square);
  return direction;
}

/// How far the unit cube reaches from a point in it.
double FindEnd(const UnitPoint& start, const UnitPoint& direction) {
  double end = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < start.size(); ++i) {
    if (direction[i] > 0.0) end = std::min(end, (1.0 - start[i]) / direction[i]);
    if (direction[i] < 0.0) end = std::min(end, -start[i] / direction[i]);
  }
  return end;
}

}  // namespace

MarginSearcher::MarginSearcher(const Search& search, const UnitPoint& start)
    : tolerance_(search.tolerance), start_(start) {
  const auto add = [&](const UnitPoint& direction) {
    margins_.push_back({direction, start, {}, 0.0, FindEnd(start, direction)});
  };
  for (size_t i = 0; i < start.size(); ++i) {
    for (const double sign : {-1.0, 1.0}) {
      UnitPoint direction(start.size(), 0.0);
      direction[i] = sign;
      add(direction);
    }
  }
  std::mt19937_64 random(search.seed);
  for (long i = 0; i < search.directions; ++i) add(MakeDirection(start.size(), &random));
}

long MarginSearcher::CountPoints(const Search& search, size_t dimensions) {
  // A direction's end is at most the cube's diagonal away.
  const double steps = std::ceil(std::log2(std::sqrt(static_cast<double>(dimensions)) / search.tolerance));
  const long directions = 2 * static_cast<long>(dimensions) + search.directions;
  return 1 + directions * (1 + std::max(static_cast<long>(steps), 0L));
}

UnitPoint MarginSearcher::PointAt(const Margin& margin, double distance) const {
  UnitPoint point = start_;
  for (size_t i = 0; i < point.size(); ++i) {
    point[i] = std::clamp(point[i] + distance * margin.direction[i], 0.0, 1.0);
  }
  return point;
}

bool MarginSearcher::IsOpen(const Margin& margin) const {
  constexpr double kRounding = 1e-9;  // of a start that is given by its values
  return !margin.bad.empty() && margin.at_most - margin.distance > tolerance_ * (1.0 + kRounding);
}

std::vector<UnitPoint> MarginSearcher::Ask() {
  queried_.clear();
  if (phase_ == Phase::kStart) return {start_};
  std::vector<UnitPoint> points;
  for (Margin& margin : margins_) {
    if (phase_ == Phase::kEnds ? !(margin.at_most > 0.0) : !IsOpen(margin)) continue;
    queried_.push_back(&margin);
    points.push_back(
        PointAt(margin, phase_ == Phase::kEnds ? margin.at_most : 0.5 * (margin.distance + margin.at_most)));
  }
  return points;
}

void MarginSearcher::Tell(const std::vector<Judgement>& judgements) {
  if (phase_ == Phase::kStart) {
    phase_ = judgements.front().is_feasible() ? Phase::kEnds : Phase::kOver;
    if (phase_ == Phase::kOver) margins_.clear();
    return;
  }
  for (size_t i = 0; i < queried_.size(); ++i) {
    Margin& margin = *queried_[i];
    const double distance =
        phase_ == Phase::kEnds ? margin.at_most : 0.5 * (margin.distance + margin.at_most);
    const bool good = judgements[i].is_feasible();
    (good ? margin.good : margin.bad) = PointAt(margin, distance);
    (good ? margin.distance : margin.at_most) = distance;
  }
  phase_ = Phase::kBisection;
}

std::vector<Margin> FindMargins(const Study& study, const std::vector<JudgedPoint>& points) {
  if (points.empty()) return {};
  const UnitPoint start = FractionsOf(study.keys(), points[0].values);
  MarginSearcher searcher(study.search, start);
  for (size_t next = 0;;) {
    const size_t count = searcher.Ask().size();
    if (count == 0 || next + count > points.size()) return searcher.margins();
    std::vector<Judgement> judgements;
    for (; judgements.size() < count; ++next) judgements.push_back(points[next].judgement);
    searcher.Tell(judgements);
  }
}

}  // namespace dexcheck
