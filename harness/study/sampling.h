#pragma once

// Points of the unit cube at which a study looks, the same on every machine.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "harness/study/study.h"
#include "harness/study/study_store.h"

namespace dexcheck {

/// Coordinates in [0, 1), one for each dimension.
using UnitPoint = std::vector<double>;

/// `count` points of a Latin hypercube: each of the `count` equal slices of every axis holds one, at a place
/// within it that the seed decides.
std::vector<UnitPoint> MakeLatinHypercube(int dimensions, long count, std::uint64_t seed);

/// Largest number of dimensions of MakeSobol.
constexpr int kMaxSobolDimensions = 64;

/// The first `count` points of the Sobol sequence with the direction numbers of Joe and Kuo (2008), from
/// Boost.Random; it begins with the origin.
/// @param scramble a seed: each axis is permuted as Owen (1995) does, digit by digit, so that every point is
///   uniformly distributed and each dyadic box keeps its fraction of the points.
std::vector<UnitPoint> MakeSobol(int dimensions, long count, std::optional<std::uint64_t> scramble = {});

/// `count` independent points, even in the cube.
std::vector<UnitPoint> MakeRandom(int dimensions, long count, std::uint64_t seed);

/// The points of a study's sample.
std::vector<UnitPoint> MakeUnitPoints(const Sample& sample, int dimensions);
/// How many points those are.
long CountUnitPoints(const Sample& sample, int dimensions);

// Which key matters: designs of points, and what follows from the values there.

/// A number and the interval that holds it with 95 %.
struct Estimate {
  double value = 0.0;
  double low = 0.0;
  double high = 0.0;
};

/// Elementary effects of a key: differences of f over a step, as of a step through the whole range.
struct MorrisEffect {
  Estimate size;        ///< mu*, the mean of their magnitudes.
  double mean = 0.0;    ///< mu.
  double spread = 0.0;  ///< sigma: it is 0 where f is linear in this key and has no interaction.
};

/// Clopper and Pearson's interval for a probability, of `failures` in `trials` independent trials; 95 %.
Estimate CalcProbability(long failures, long trials);

// Which of a study's keys matters for what.

/// Effects on one quantity that the points of a study with `method = "morris"` show.
struct Sensitivity {
  std::string expression;             ///< Of metrics.
  std::vector<MorrisEffect> effects;  ///< By key; empty where no two points of a step have a value.
  long left_out = 0;                  ///< Points without a value: a trial was not held, or is missing.

  /// Keys by the size of their effect, the largest first.
  [[nodiscard]] std::vector<size_t> ListByImportance() const;
};

/// Analyses the means of the points' trials.
Sensitivity AnalyseSensitivity(const Study& study, const std::vector<TrialRow>& rows,
                               const std::string& expression);

/// The quantities of a study of this kind: its objectives, else its metrics, else the error of its trials.
std::vector<std::string> ListQuantities(const Study& study, const std::vector<TrialRow>& rows);

/// "energy: x1 moves it by 62 (55 to 70) J, x2 ... over its range.".
std::string Describe(const Study& study, const Sensitivity& sensitivity);

}  // namespace dexcheck
