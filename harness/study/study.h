#pragma once

// What a study is: a scenario, the keys that are varied, and the list of trials that follows from both.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace dexcheck {

/// One varied key of the scenario.
struct Variation {
  std::string key;             ///< As --set takes it.
  std::vector<double> values;  ///< Of a grid; empty in sampled studies.
  /// Of a key whose values are texts: values and parameters are then their numbers, from 0. Empty for
  /// numbers.
  std::vector<std::string> labels;
  double from = 0.0;  ///< Ends of the range.
  double to = 0.0;
  bool logarithmic = false;  ///< Even in the logarithm.
};

enum class Sampling { kGrid, kLatinHypercube, kSobol };

/// A study file.
struct Study {
  std::string name;
  std::string description;
  std::string scenario;                ///< Shipped name, or file relative to the study's.
  std::vector<std::string> overrides;  ///< "PATH=VALUE", the same for all trials.
  std::vector<Variation> variations;   ///< The last varies fastest.
  Sampling sampling = Sampling::kGrid;
  long samples = 0;                        ///< Of sampled studies.
  std::uint64_t sample_seed = 0;           ///< Of a Latin hypercube.
  std::vector<std::uint64_t> seeds = {0};  ///< Of the grasp; every point is tried with each.
  bool check = false;                      ///< Cross-check the trials.
  double trial_time_limit = 0.0;           ///< Most processor time of a trial, s; 0 for any.
  std::vector<std::string> metrics;        ///< That the report shows.

  std::string text;    ///< The file.
  std::string source;  ///< Its name, for messages.
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

/// All trials; the same list for the same file, always.
std::vector<Trial> ListTrials(const Study& study);

/// A value of the key as --set takes it.
std::string FormatValue(const Variation& variation, double value);

/// What makes the study's scenario into this trial: "PATH=VALUE" each.
std::vector<std::string> ListOverrides(const Study& study, const Trial& trial);

}  // namespace dexcheck
