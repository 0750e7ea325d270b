#pragma once

// A study: a scenario, the keys that are varied, and the list of trials that follows from both.

#include <cstdint>
#include <string>
#include <vector>

#include "harness/study/objective.h"

namespace dexcheck {

/// One varied key of the scenario.
struct Variation {
  std::string key;             ///< As --set takes it.
  std::vector<double> values;  ///< Of a grid; empty in sampled studies.
  /// Texts of a key whose values are texts; values and parameters are then their numbers, from 0. Empty for
  /// numbers.
  std::vector<std::string> labels;
  double from = 0.0;  ///< Ends of the range.
  double to = 0.0;
  bool logarithmic = false;  ///< Even in the logarithm.
  bool operator==(const Variation&) const = default;
};

enum class SamplingMethod { kGrid, kLatinHypercube, kSobol, kRandom, kMorris };

/// Points of the ranges of some keys.
struct Sample {
  SamplingMethod method = SamplingMethod::kGrid;
  long count = 0;          ///< Points; of a grid its keys say how many. Trajectories of kMorris.
  std::uint64_t seed = 0;  ///< Of all but a grid and a Sobol sequence that is not scrambled.
  bool scramble = false;   ///< A Sobol sequence.
  bool operator==(const Sample&) const = default;
};

enum class SearchMethod { kNone, kCmaEs, kNelderMead };

/// How a study looks for the best point.
struct Search {
  SearchMethod method = SearchMethod::kNone;
  long count = 0;           ///< Points at most.
  long population = 0;      ///< Points of a generation, of kCmaEs.
  long starts = 1;          ///< Local searches at a time, of kNelderMead.
  double step = 0.25;       ///< First step relative to the ranges.
  double tolerance = 1e-3;  ///< Relative to the ranges: where a local search ends.
  std::uint64_t seed = 0;
  std::vector<double> start_values;  ///< One for each key; empty for the middle of the ranges.
  bool operator==(const Search&) const = default;
};

/// A study file.
struct Study {
  std::string name;
  std::string description;
  std::string scenario;                ///< Shipped name, or file relative to the study's.
  std::string controller;              ///< Of the user's own, as controller.run; empty for the scenario's.
  std::vector<std::string> overrides;  ///< "PATH=VALUE", the same for all trials.
  std::vector<Variation> variations;   ///< The last varies fastest.
  Sample sample;
  Search search;
  std::vector<Objective> objectives;
  std::vector<Constraint> constraints;
  std::vector<std::uint64_t> seeds = {0};  ///< Of the grasp; every point is tried with each.
  bool check = false;                      ///< Cross-check the trials.
  double trial_time_limit = 0.0;           ///< Most processor time of a trial, s; 0 for any.
  double stop_error = 0.0;                 ///< Position error that ends a trial, m; 0 for none.
  std::vector<std::string> metrics;        ///< That the report shows.

  std::string text;    ///< The file.
  std::string source;  ///< Its name, for messages.

  [[nodiscard]] bool is_search() const { return search.method != SearchMethod::kNone; }
};

/// One run of a study.
struct Trial {
  long number = 0;                 ///< From 0.
  std::uint64_t seed = 0;          ///< Of the grasp.
  std::vector<double> parameters;  ///< One value for each variation.
};

/// Most trials of a study.
constexpr long kMaxTrials = 1000000;

/// Reads a study. @throws InputError, one line that names file, line, key and value.
Study ParseStudy(const std::string& text, const std::string& source);

/// All trials; the same list for the same file, always. Not of a search, whose points follow from results.
std::vector<Trial> ListTrials(const Study& study);

/// Whether a metric, objective or constraint is of a loop's margins, which cost more than a short trial.
bool NeedsMargins(const Study& study);

/// How many trials there are; of a search at most.
long CountTrials(const Study& study);

/// Trials of one point: one for each seed.
long CountTrialsOfPoint(const Study& study);

/// The trials of a point: point `number` has those from number * CountTrialsOfPoint on.
std::vector<Trial> ListTrialsOfPoint(const Study& study, long number, const std::vector<double>& point);

/// A value of a range, or of a list of values: 0 is its beginning, 1 its end. @param fraction in [0, 1].
double ValueAt(const Variation& variation, double fraction);
/// The fraction at which ValueAt returns this value; of a list the middle of its part.
double FractionOf(const Variation& variation, double value);

/// Values of a point at these fractions.
std::vector<double> ValuesAt(const std::vector<Variation>& variations, const std::vector<double>& fractions);

/// A value of the key as --set takes it.
std::string FormatValue(const Variation& variation, double value);

/// Assignments, "PATH=VALUE" each, that make the study's scenario this trial.
std::vector<std::string> ListOverrides(const Study& study, const Trial& trial);

/// The first key in which two studies make other trials, or ask for what the trials do not have; empty where
/// the rows of one are rows of the other.
std::string FindDifference(const Study& before, const Study& now);

}  // namespace dexcheck
