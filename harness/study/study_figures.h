#pragma once

// Figures of a study, as inline SVG that leads from points and cells to trials.

#include <string>
#include <vector>

#include "harness/report/html.h"
#include "harness/study/study_store.h"

namespace dexcheck {

/// A study and what came of it.
struct StudyResults {
  explicit StudyResults(const StudyStore& store);
  StudyResults(const StudyResults&) = delete;  // `listed` points into `rows`
  StudyResults& operator=(const StudyResults&) = delete;

  Study study;
  StudyInputs inputs;  ///< As far as the database keeps them: for scenarios of trials.
  std::vector<TrialRow> rows;
  Metric error = kPositionErrorRms;  ///< That says how good the trials are, see FindErrorMetric.
  std::vector<Metric> metrics;       ///< To be shown.
  /// Trials that the page has one by one: all of a small study, else an even part, the best and the front; by
  /// number.
  std::vector<const TrialRow*> listed;
  [[nodiscard]] bool of_joints() const { return error == kJointErrorRms; }
  [[nodiscard]] bool lists_all() const { return listed.size() == rows.size(); }

  /// Trials that tracked, least rms error first.
  [[nodiscard]] std::vector<const TrialRow*> ListTracked() const;
};

/// Trials in the table of the best.
constexpr size_t kMostBest = 20;

/// Overshoot that can be seen, relative to the start error; larger than what settling leaves.
constexpr double kVisibleOvershoot = 0.01;

/// "#rrggbb".
std::string FindColor(Outcome outcome);
/// "position_error_rms, m".
std::string LabelOf(Metric metric);
/// "#trial-7".
std::string LinkTo(const TrialRow& row);
/// "trial 7: KEY = VALUE, ..., tracked".
std::string Describe(const Study& study, const TrialRow& row);

/// Outcomes over the first two keys, with the measured and the theoretical boundary of stability.
Html DrawOutcomes(const StudyResults& results);
/// A map for each metric over the first two keys of a grid; empty for other studies.
Html DrawMetrics(const StudyResults& results);
/// Metrics along the first key of a grid, a line for each of a few values of the second; empty for
/// other studies.
Html DrawLines(const StudyResults& results);
/// Error against effort of all trials that tracked, with the Pareto front; empty when none did.
Html DrawErrorAgainstEffort(const StudyResults& results);

}  // namespace dexcheck
