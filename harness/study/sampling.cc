#include "harness/study/sampling.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/special_functions/beta.hpp>
#include <boost/random/sobol.hpp>
#include <cmath>
#include <numeric>
#include <random>

#include "controller/common/errors.h"
#include "harness/plant/random_stream.h"

namespace dexcheck {

namespace {

std::uint32_t ReverseBits(std::uint32_t x) {
  x = ((x >> 1U) & 0x55555555U) | ((x & 0x55555555U) << 1U);
  x = ((x >> 2U) & 0x33333333U) | ((x & 0x33333333U) << 2U);
  x = ((x >> 4U) & 0x0f0f0f0fU) | ((x & 0x0f0f0f0fU) << 4U);
  return __builtin_bswap32(x);
}

/// Flips each binary digit by a hash of the digits before it [Burley 2020, with Vegdahl's constants].
std::uint32_t ScrambleDigits(std::uint32_t x, std::uint32_t seed) {
  x = ReverseBits(x);
  x ^= x * 0x3d20adeaU;
  x += seed;
  x *= (seed >> 16U) | 1U;
  x ^= x * 0x05526c56U;
  x ^= x * 0x53a22864U;
  return ReverseBits(x);
}

// The standard does not say what std::shuffle draws.

/// 0 to size - 1 in random order.
void ShuffleNumbers(std::vector<size_t>* numbers, std::mt19937_64* random) {
  std::iota(numbers->begin(), numbers->end(), size_t{0});
  for (size_t i = numbers->size(); i > 1; --i) std::swap((*numbers)[i - 1], (*numbers)[(*random)() % i]);
}

std::vector<UnitPoint> MakePoints(int dimensions, long count) {
  return {static_cast<size_t>(count), UnitPoint(static_cast<size_t>(dimensions))};
}

/// Morris's design: `count` trajectories of k + 1 points; each step of a trajectory moves one key, in random
/// order, by 2/3 of its range between the levels 0, 1/3, 2/3, 1.
std::vector<UnitPoint> MakeMorris(int dimensions, long count, std::uint64_t seed) {
  const auto k = static_cast<size_t>(dimensions);
  constexpr double kLevel = 1.0 / 3.0;
  std::mt19937_64 random(seed);
  std::vector<UnitPoint> points;
  std::vector<size_t> order(k);
  for (long trajectory = 0; trajectory < count; ++trajectory) {
    UnitPoint point(k);
    for (double& x : point) x = kLevel * static_cast<double>(random() % 4);
    points.push_back(point);
    ShuffleNumbers(&order, &random);
    for (const size_t i : order) {
      // Two levels on or back: from each of the four levels one of them stays inside.
      point[i] += point[i] < 0.5 ? 2.0 * kLevel : -2.0 * kLevel;
      points.push_back(point);
    }
  }
  return points;
}

constexpr double kOutside = 0.025;  // on either side of an interval of 95 %
constexpr int kResamples = 200;
constexpr std::uint64_t kBootstrapSeed = 1;

/// From the percentiles of a sample.
Estimate MakeEstimate(double value, std::vector<double> sample) {
  std::ranges::sort(sample);
  const auto at = [&](double fraction) {
    const double place = fraction * static_cast<double>(sample.size() - 1);
    return sample[static_cast<size_t>(std::lround(place))];
  };
  return {value, at(kOutside), at(1.0 - kOutside)};
}

/// The elementary effects of one key; zeros where it has none. The interval follows from samples of them.
MorrisEffect Summarise(const std::vector<double>& effects, std::mt19937_64* random) {
  MorrisEffect effect;
  if (effects.empty()) return effect;
  const auto n = static_cast<double>(effects.size());
  double size = 0.0;
  for (const double value : effects) {
    effect.mean += value / n;
    size += std::abs(value) / n;
  }
  for (const double value : effects) effect.spread += (value - effect.mean) * (value - effect.mean);
  effect.spread = std::sqrt(effect.spread / std::max(n - 1.0, 1.0));
  std::vector<double> sizes;
  for (int resample = 0; resample < kResamples; ++resample) {
    double sum = 0.0;
    for (size_t i = 0; i < effects.size(); ++i) sum += std::abs(effects[(*random)() % effects.size()]);
    sizes.push_back(sum / n);
  }
  effect.size = MakeEstimate(size, sizes);
  return effect;
}

/// @param points of MakeMorris. @param values f there. Steps with a value that is not finite are left out.
std::vector<MorrisEffect> CalcMorrisEffects(const std::vector<UnitPoint>& points,
                                            const std::vector<double>& values) {
  if (points.empty()) return {};
  const size_t k = points.front().size();
  std::vector<std::vector<double>> effects(k);
  const size_t count = std::min(points.size(), values.size());
  for (size_t begin = 0; begin + k + 1 <= count; begin += k + 1) {
    for (size_t step = begin; step < begin + k; ++step) {
      for (size_t i = 0; i < k; ++i) {
        const double distance = points[step + 1][i] - points[step][i];
        const double effect = (values[step + 1] - values[step]) / distance;
        if (distance != 0.0 && std::isfinite(effect)) effects[i].push_back(effect);
      }
    }
  }
  if (std::ranges::all_of(effects, [](const auto& all) { return all.empty(); })) return {};
  std::vector<MorrisEffect> result;
  result.reserve(k);
  std::mt19937_64 random(kBootstrapSeed);
  for (const std::vector<double>& of_key : effects) result.push_back(Summarise(of_key, &random));
  return result;
}

}  // namespace

std::vector<UnitPoint> MakeLatinHypercube(int dimensions, long count, std::uint64_t seed) {
  std::vector<UnitPoint> points = MakePoints(dimensions, count);
  std::mt19937_64 random(seed);
  std::vector<size_t> slices(points.size());
  for (size_t d = 0; d < static_cast<size_t>(dimensions); ++d) {
    ShuffleNumbers(&slices, &random);
    for (size_t i = 0; i < points.size(); ++i)
      points[i][d] = (static_cast<double>(slices[i]) + DrawUnit(&random)) / static_cast<double>(count);
  }
  return points;
}

std::vector<UnitPoint> MakeSobol(int dimensions, long count, std::optional<std::uint64_t> scramble) {
  Require(dimensions >= 1 && dimensions <= kMaxSobolDimensions, "dimensions", "must be from 1 to 64",
          dimensions);
  using Engine = boost::random::sobol_engine<std::uint32_t, 32>;
  Engine engine(static_cast<size_t>(dimensions));
  std::vector<std::uint32_t> seeds(static_cast<size_t>(dimensions));
  std::mt19937_64 random(scramble.value_or(0));
  for (std::uint32_t& seed : seeds) seed = static_cast<std::uint32_t>(random() >> 32U);
  std::vector<UnitPoint> points = MakePoints(dimensions, count);
  for (size_t i = 0; i < points.size(); ++i) {
    for (size_t d = 0; d < points[i].size(); ++d) {
      // Boost's sequence leaves the origin out.
      const std::uint32_t x = i == 0 ? 0 : engine();
      points[i][d] = static_cast<double>(scramble ? ScrambleDigits(x, seeds[d]) : x) * 0x1p-32;
    }
  }
  return points;
}

std::vector<UnitPoint> MakeRandom(int dimensions, long count, std::uint64_t seed) {
  std::vector<UnitPoint> points = MakePoints(dimensions, count);
  std::mt19937_64 random(seed);
  for (UnitPoint& point : points) {
    for (double& x : point) x = DrawUnit(&random);
  }
  return points;
}

std::vector<UnitPoint> MakeUnitPoints(const Sample& sample, int dimensions) {
  switch (sample.method) {
    case SamplingMethod::kSobol:
      return MakeSobol(dimensions, sample.count,
                       sample.scramble ? std::optional<std::uint64_t>(sample.seed) : std::nullopt);
    case SamplingMethod::kRandom:
      return MakeRandom(dimensions, sample.count, sample.seed);
    case SamplingMethod::kMorris:
      return MakeMorris(dimensions, sample.count, sample.seed);
    case SamplingMethod::kLatinHypercube:
    case SamplingMethod::kGrid:
      break;
  }
  return MakeLatinHypercube(dimensions, sample.count, sample.seed);
}

long CountUnitPoints(const Sample& sample, int dimensions) {
  return sample.method == SamplingMethod::kMorris ? sample.count * (dimensions + 1) : sample.count;
}

Estimate CalcProbability(long failures, long trials) {
  Require(trials > 0 && failures >= 0 && failures <= trials, "failures", "must be among the trials",
          static_cast<double>(failures));
  const auto k = static_cast<double>(failures);
  const auto n = static_cast<double>(trials);
  // The bounds at which so many failures, or more, or less, would have a probability of 2.5 %.
  return {k / n, failures == 0 ? 0.0 : boost::math::ibeta_inv(k, n - k + 1.0, kOutside),
          failures == trials ? 1.0 : boost::math::ibetac_inv(k + 1.0, n - k, kOutside)};
}

std::vector<size_t> Sensitivity::ListByImportance() const {
  std::vector<size_t> keys(effects.size());
  std::iota(keys.begin(), keys.end(), size_t{0});
  std::ranges::stable_sort(keys, std::ranges::greater{}, [&](size_t i) { return effects[i].size.value; });
  return keys;
}

Sensitivity AnalyseSensitivity(const Study& study, const std::vector<TrialRow>& rows,
                               const std::string& expression) {
  const int dimensions = static_cast<int>(study.variations.size());
  const long per_point = CountTrialsOfPoint(study);
  const auto count = static_cast<size_t>(CountUnitPoints(study.sample, dimensions));
  std::vector<double> values(count, 0.0);
  std::vector<long> done(count, 0);
  for (const TrialRow& row : rows) {
    const auto point = static_cast<size_t>(row.trial.number / per_point);
    if (point >= count) continue;
    values[point] += IsHeld(row.result.outcome) ? EvaluateMetrics(expression, row.result) : std::nan("");
    ++done[point];
  }
  Sensitivity sensitivity;
  sensitivity.expression = expression;
  for (size_t i = 0; i < count; ++i) {
    values[i] = done[i] == per_point ? values[i] / static_cast<double>(per_point) : std::nan("");
    if (!std::isfinite(values[i])) ++sensitivity.left_out;
  }
  sensitivity.effects = CalcMorrisEffects(MakeUnitPoints(study.sample, dimensions), values);
  return sensitivity;
}

std::vector<std::string> ListQuantities(const Study& study, const std::vector<TrialRow>& rows) {
  std::vector<std::string> quantities;
  for (const Objective& objective : study.objectives) quantities.push_back(objective.expression);
  if (quantities.empty()) quantities = study.metrics;
  if (quantities.empty()) quantities.emplace_back(kMetrics[FindErrorMetric(rows)].name);
  return quantities;
}

std::string Describe(const Study& study, const Sensitivity& sensitivity) {
  constexpr size_t kMostNamed = 3;
  constexpr double kSmall = 0.1;
  const std::vector<MorrisEffect>& effects = sensitivity.effects;
  if (effects.empty()) return sensitivity.expression + " does not vary, or too few trials were held.";
  const std::vector<size_t> keys = sensitivity.ListByImportance();
  const size_t named = std::min(kMostNamed, keys.size());
  std::string text = sensitivity.expression + ":";
  for (size_t i = 0; i < named; ++i) {
    const Estimate& size = effects[keys[i]].size;
    text += fmt::format("{} {} moves it by {:.3g} ({:.3g} to {:.3g}){} over its range",
                        i == 0          ? ""
                        : i + 1 < named ? ","
                                        : " and",
                        study.variations[keys[i]].key, size.value, size.low, size.high,
                        ShowUnit(sensitivity.expression));
  }
  const double largest = effects[keys.front()].size.value;
  const auto idle = std::ranges::count_if(
      effects, [&](const MorrisEffect& effect) { return effect.size.high < kSmall * largest; });
  if (idle > 0)
    text += fmt::format("; {} of {} keys move it by less than a tenth of the first", idle, keys.size());
  if (sensitivity.left_out > 0) text += fmt::format(" ({} points have no value)", sensitivity.left_out);
  return text + ".";
}

}  // namespace dexcheck
