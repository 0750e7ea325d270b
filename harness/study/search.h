#pragma once

// Searches with an ask-and-tell interface: which points of the unit cube come next, and what the last ones
// came to.

#include <map>
#include <memory>
#include <vector>

#include "harness/study/objective.h"
#include "harness/study/sampling.h"
#include "harness/study/study.h"
#include "harness/study/study_store.h"

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

// A search as it follows from its rows: the points tried so far, and the trials that come next.

/// A point that a study tried, with all its trials done.
struct JudgedPoint {
  long number = 0;             ///< Its trials begin at number * CountTrialsOfPoint.
  std::vector<double> values;  ///< Of the study's own keys.
  Judgement judgement;
};

/// Follows a search through its rows. The same rows always lead to the same next trials, so that a search
/// that was killed goes on as if nothing had happened.
class SearchHistory {
 public:
  /// @param start as FindSearchStart.
  SearchHistory(const Study& study, const UnitPoint& start);

  /// Takes in a trial's row; rows may come in any order.
  /// @throws InputError when the search would not have made this trial.
  void Add(const TrialRow& row);

  /// Trials of the batch at hand that have no row yet; none when the search is over.
  [[nodiscard]] std::vector<Trial> ListMissing() const;
  [[nodiscard]] bool is_over() const { return batch_.empty(); }
  /// Number of the first trial of the batch at hand.
  [[nodiscard]] long first_of_batch() const;
  /// Trials that are made: of whole batches, and those of the batch at hand.
  [[nodiscard]] long CountDone() const;
  /// How many trials the batch at hand has, with those that are made.
  [[nodiscard]] long size_of_batch() const { return static_cast<long>(batch_.size()) * per_point_; }
  /// In the order of their numbers.
  [[nodiscard]] const std::vector<JudgedPoint>& points() const { return points_; }

 private:
  void AskNext();
  void TellWhatIsDone();

  Study study_;
  long per_point_;
  std::vector<std::vector<double>> draws_;
  std::unique_ptr<Searcher> searcher_;
  std::vector<std::vector<double>> batch_;  // values of each of its points
  std::map<long, TrialRow> rows_;           // of the batch and after it
  std::vector<JudgedPoint> points_;
};

/// Where a search begins, as `[search] start` says.
UnitPoint FindSearchStart(const Study& study);

/// Points of any study whose trials are all there, judged by its objectives.
std::vector<JudgedPoint> JudgePoints(const Study& study, const std::vector<TrialRow>& rows);

/// The feasible points of one objective, the best first; equals as they were.
std::vector<const JudgedPoint*> SortFeasible(const std::vector<JudgedPoint>& points);

/// Feasible points that none dominates, by the first objective.
std::vector<const JudgedPoint*> FindFront(const std::vector<JudgedPoint>& points);

// How far one may go from a point before a constraint turns.

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
