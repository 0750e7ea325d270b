#pragma once

// Searches that are asked for points and observe results: which points of the unit cube come next, and what
// the last ones came to.

#include <map>
#include <memory>
#include <vector>

#include "harness/study/objective.h"
#include "harness/study/sampling.h"
#include "harness/study/study.h"
#include "harness/study/study_store.h"

namespace dexcheck {

/// A search for the best of one objective. Its next points depend on its settings and on the judgements so
/// far, and on nothing else.
class Searcher {
 public:
  Searcher() = default;
  virtual ~Searcher() = default;
  Searcher(const Searcher&) = delete;
  Searcher& operator=(const Searcher&) = delete;

  /// The points of the next batch, to be tried in any order; none when the search is over.
  [[nodiscard]] virtual std::vector<UnitPoint> Ask() = 0;
  /// Takes in the judgements of the last batch's points, in its order.
  virtual void Observe(const std::vector<Judgement>& judgements) = 0;
};

/// The search of these settings.
///
/// CMA-ES is pagmo's: a batch is a generation. The first one is a Latin hypercube, with the start in the
/// place of its first point. Nelder and Mead's method is NLopt's: a batch has a point of each of the local
/// searches. The first of these begins at the start, the others at points of a Latin hypercube.
std::unique_ptr<Searcher> MakeSearcher(const Search& search, const UnitPoint& start);

// A search as it follows from its rows: the points tried so far, and the trials that come next.

/// A point that a study tried, with all its trials done.
struct JudgedPoint {
  long number = 0;             ///< Its trials begin at number * CountTrialsOfPoint.
  std::vector<double> values;  ///< Of the study's keys.
  Judgement judgement;
};

/// Follows a search through its rows. The same rows always lead to the same next trials, so that a search
/// that was killed goes on as if nothing had happened.
class SearchHistory {
 public:
  explicit SearchHistory(const Study& study);

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
  /// In the order of their numbers.
  [[nodiscard]] const std::vector<JudgedPoint>& points() const { return points_; }

 private:
  void AskNext();
  void ObserveWhatIsDone();

  Study study_;
  std::unique_ptr<Searcher> searcher_;
  std::vector<std::vector<double>> batch_;  // values of each of its points
  std::map<long, TrialRow> rows_;           // of the batch and after it
  std::vector<JudgedPoint> points_;
};

/// Points of any study whose trials are all there, judged by its objectives.
std::vector<JudgedPoint> JudgePoints(const Study& study, const std::vector<TrialRow>& rows);

/// The feasible points of one objective, the best first; equals as they were.
std::vector<const JudgedPoint*> SortFeasible(const std::vector<JudgedPoint>& points);

/// Feasible points that none dominates, by the first objective.
std::vector<const JudgedPoint*> FindFront(const std::vector<JudgedPoint>& points);

}  // namespace dexcheck
