#include "harness/study/sampling.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/special_functions/beta.hpp>
#include <boost/random/sobol.hpp>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "controller/common/errors.h"

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

// What the standard's own distributions and std::shuffle draw, it leaves open.

/// Even in [0, 1).
double DrawUnit(std::mt19937_64* random) { return static_cast<double>((*random)() >> 11U) * 0x1p-53; }

/// 0 to size - 1 in random order.
void ShuffleNumbers(std::vector<size_t>* numbers, std::mt19937_64* random) {
  std::iota(numbers->begin(), numbers->end(), size_t{0});
  for (size_t i = numbers->size(); i > 1; --i) std::swap((*numbers)[i - 1], (*numbers)[(*random)() % i]);
}

std::vector<UnitPoint> MakePoints(int dimensions, long count) {
  return {static_cast<size_t>(count), UnitPoint(static_cast<size_t>(dimensions))};
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
    case SamplingMethod::kSaltelli:
      return MakeSaltelli(dimensions, sample.count, sample.seed);
    case SamplingMethod::kMorris:
      return MakeMorris(dimensions, sample.count, sample.seed);
    case SamplingMethod::kLatinHypercube:
    case SamplingMethod::kGrid:
      break;
  }
  return MakeLatinHypercube(dimensions, sample.count, sample.seed);
}

long CountUnitPoints(const Sample& sample, int dimensions) {
  if (sample.method == SamplingMethod::kSaltelli) return sample.count * (dimensions + 2);
  if (sample.method == SamplingMethod::kMorris) return sample.count * (dimensions + 1);
  return sample.count;
}

int CountMostDimensions(const Sample& sample) {
  if (sample.method == SamplingMethod::kSobol) return kMaxSobolDimensions;
  if (sample.method == SamplingMethod::kSaltelli) return kMaxSobolDimensions / 2;
  return std::numeric_limits<int>::max();
}

namespace {

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

/// f at one block of Saltelli's design.
struct Block {
  double A, B;
  std::span<const double> A_B;
};

/// Indices from some blocks, by number. @return first and total, key by key; empty when f does not vary.
std::vector<std::pair<double, double>> CalcIndices(const std::vector<Block>& blocks,
                                                   const std::vector<size_t>& chosen, size_t dimensions) {
  const auto count = static_cast<double>(chosen.size());
  double mean = 0.0;
  for (const size_t j : chosen) mean += 0.5 * (blocks[j].A + blocks[j].B) / count;
  double variance = 0.0;
  for (const size_t j : chosen) {
    const double a = blocks[j].A - mean;
    const double b = blocks[j].B - mean;
    variance += 0.5 * (a * a + b * b) / count;
  }
  if (!(variance > 0.0)) return {};
  std::vector<std::pair<double, double>> indices(dimensions, {0.0, 0.0});
  for (const size_t j : chosen) {
    const Block& block = blocks[j];
    for (size_t i = 0; i < dimensions; ++i) {
      const double step = block.A_B[i] - block.A;
      indices[i].first += (block.B - mean) * step / (count * variance);
      indices[i].second += 0.5 * step * step / (count * variance);
    }
  }
  return indices;
}

}  // namespace

std::vector<UnitPoint> MakeSaltelli(int dimensions, long count, std::uint64_t seed) {
  const auto k = static_cast<size_t>(dimensions);
  std::vector<UnitPoint> points;
  points.reserve(static_cast<size_t>(count) * (k + 2));
  for (const UnitPoint& both : MakeSobol(2 * dimensions, count, seed)) {
    const UnitPoint A(both.begin(), both.begin() + dimensions);
    const UnitPoint B(both.begin() + dimensions, both.end());
    points.push_back(A);
    points.push_back(B);
    for (size_t i = 0; i < k; ++i) {
      points.push_back(A);
      points.back()[i] = B[i];
    }
  }
  return points;
}

std::vector<SobolIndex> CalcSobolIndices(std::span<const double> values, int dimensions) {
  const auto k = static_cast<size_t>(dimensions);
  std::vector<Block> blocks;
  for (size_t begin = 0; begin + k + 2 <= values.size(); begin += k + 2) {
    const std::span<const double> block = values.subspan(begin, k + 2);
    if (!std::ranges::all_of(block, [](double value) { return std::isfinite(value); })) continue;
    blocks.push_back({block[0], block[1], block.subspan(2)});
  }
  if (blocks.size() < 2) return {};
  std::vector<size_t> chosen(blocks.size());
  std::iota(chosen.begin(), chosen.end(), size_t{0});
  const auto whole = CalcIndices(blocks, chosen, k);
  if (whole.empty()) return {};
  std::vector<std::vector<double>> first(k);
  std::vector<std::vector<double>> total(k);
  std::mt19937_64 random(kBootstrapSeed);
  for (int resample = 0; resample < kResamples; ++resample) {
    for (size_t& j : chosen) j = random() % blocks.size();
    const auto indices = CalcIndices(blocks, chosen, k);
    for (size_t i = 0; i < indices.size(); ++i) {
      first[i].push_back(indices[i].first);
      total[i].push_back(indices[i].second);
    }
  }
  std::vector<SobolIndex> indices;
  for (size_t i = 0; i < k; ++i) {
    indices.push_back({MakeEstimate(whole[i].first, first[i]), MakeEstimate(whole[i].second, total[i])});
  }
  return indices;
}

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

std::vector<MorrisEffect> CalcMorrisEffects(std::span<const UnitPoint> points,
                                            std::span<const double> values) {
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
  std::mt19937_64 random(kBootstrapSeed);
  for (const std::vector<double>& all : effects) {
    MorrisEffect effect;
    const auto n = static_cast<double>(all.size());
    if (!all.empty()) {
      double size = 0.0;
      for (const double value : all) {
        effect.mean += value / n;
        size += std::abs(value) / n;
      }
      for (const double value : all) effect.spread += (value - effect.mean) * (value - effect.mean);
      effect.spread = std::sqrt(effect.spread / std::max(n - 1.0, 1.0));
      std::vector<double> sample;
      for (int resample = 0; resample < kResamples; ++resample) {
        double sum = 0.0;
        for (size_t j = 0; j < all.size(); ++j) sum += std::abs(all[random() % all.size()]);
        sample.push_back(sum / n);
      }
      effect.size = MakeEstimate(size, sample);
    }
    result.push_back(effect);
  }
  return result;
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
  std::vector<size_t> keys(std::max(sobol.size(), morris.size()));
  std::iota(keys.begin(), keys.end(), size_t{0});
  const auto importance = [&](size_t i) {
    return sobol.empty() ? morris[i].size.value : sobol[i].total.value;
  };
  std::ranges::stable_sort(keys, [&](size_t a, size_t b) { return importance(a) > importance(b); });
  return keys;
}

Sensitivity AnalyseSensitivity(const Study& study, const std::vector<TrialRow>& rows,
                               const std::string& expression) {
  const int dimensions = static_cast<int>(study.num_keys());
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
  if (study.sample.method == SamplingMethod::kSaltelli) {
    sensitivity.sobol = CalcSobolIndices(values, dimensions);
  } else {
    sensitivity.morris = CalcMorrisEffects(MakeUnitPoints(study.sample, dimensions), values);
  }
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
  constexpr size_t kNamed = 3;
  constexpr double kMatters = 0.01;  // of the variance
  if (sensitivity.empty()) return sensitivity.expression + " does not vary, or too few trials were held.";
  const std::vector<size_t> keys = sensitivity.ListByImportance();
  std::string text = sensitivity.expression + ":";
  size_t named = 0;
  for (const size_t i : keys) {
    if (named == kNamed) break;
    const std::string& key = study.variations[i].key;
    const std::string separator = named == 0                                   ? " "
                                  : named + 1 == std::min(kNamed, keys.size()) ? " and "
                                                                               : ", ";
    if (sensitivity.sobol.empty()) {
      const MorrisEffect& effect = sensitivity.morris[i];
      text +=
          fmt::format("{}{} moves it by {:.3g} ({:.3g} to {:.3g}){} over its range", separator, key,
                      effect.size.value, effect.size.low, effect.size.high, ShowUnit(sensitivity.expression));
    } else {
      const SobolIndex& index = sensitivity.sobol[i];
      text += fmt::format("{}{} explains {:.0f} % ({:.0f} to {:.0f}) of its variance, {:.0f} % alone",
                          separator, key, 100.0 * index.total.value, 100.0 * index.total.low,
                          100.0 * index.total.high, 100.0 * std::max(index.first.value, 0.0));
    }
    ++named;
  }
  if (sensitivity.sobol.empty()) {
    constexpr double kSmall = 0.1;
    const double largest = sensitivity.morris[keys.front()].size.value;
    const auto idle = std::ranges::count_if(
        keys, [&](size_t i) { return sensitivity.morris[i].size.high < kSmall * largest; });
    if (idle > 0)
      text += fmt::format("; {} of {} keys move it by less than a tenth of the first", idle, keys.size());
  } else {
    const auto idle =
        std::ranges::count_if(keys, [&](size_t i) { return sensitivity.sobol[i].total.high < kMatters; });
    if (idle > 0) text += fmt::format("; {} of {} keys explain less than 1 %", idle, keys.size());
  }
  if (sensitivity.left_out > 0) text += fmt::format(" ({} points have no value)", sensitivity.left_out);
  return text + ".";
}

}  // namespace dexcheck
