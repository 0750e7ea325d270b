#include "harness/study/sampling.h"

#include <algorithm>
#include <boost/random/sobol.hpp>
#include <limits>
#include <numeric>
#include <random>

#include "controller/common/errors.h"
#include "harness/study/sensitivity.h"

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

}  // namespace

std::vector<UnitPoint> MakeLatinHypercube(int dimensions, long count, std::uint64_t seed) {
  std::vector<UnitPoint> points(static_cast<size_t>(count), UnitPoint(static_cast<size_t>(dimensions)));
  std::mt19937_64 random(seed);
  std::vector<size_t> slices(points.size());
  for (size_t d = 0; d < static_cast<size_t>(dimensions); ++d) {
    std::iota(slices.begin(), slices.end(), size_t{0});
    // Not std::shuffle, whose draws the standard leaves open.
    for (size_t i = slices.size(); i > 1; --i) std::swap(slices[i - 1], slices[random() % i]);
    for (size_t i = 0; i < points.size(); ++i) {
      const double within = static_cast<double>(random() >> 11U) * 0x1p-53;
      points[i][d] = (static_cast<double>(slices[i]) + within) / static_cast<double>(count);
    }
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
  std::vector<UnitPoint> points(static_cast<size_t>(count), UnitPoint(static_cast<size_t>(dimensions)));
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
  std::vector<UnitPoint> points(static_cast<size_t>(count), UnitPoint(static_cast<size_t>(dimensions)));
  std::mt19937_64 random(seed);
  for (UnitPoint& point : points) {
    for (double& x : point) x = static_cast<double>(random() >> 11U) * 0x1p-53;
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

}  // namespace dexcheck
