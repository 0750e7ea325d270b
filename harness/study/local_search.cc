// NLopt calls the function itself and cannot be stopped in between. So each question
// begins it anew: it is given the values that are known, and at the first point without one they are
// stopped. That takes n^2 calls for n points, which costs nothing beside n trials.

#include <algorithm>
#include <cmath>
#include <nlopt.hpp>

#include "harness/study/search.h"

namespace dexcheck {
namespace {

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
    const double worst = *std::max_element(descent.values.begin(), descent.values.end());
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
