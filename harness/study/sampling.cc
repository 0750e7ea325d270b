#include "harness/study/sampling.h"

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>
#include <random>

#include "controller/common/errors.h"

namespace dexcheck {
namespace {

constexpr int kSobolBits = 32;

/// Primitive polynomial and first direction numbers of one dimension after the first.
struct SobolDimension {
  int degree;
  std::uint32_t coefficients;  // of the polynomial, without the first and the last
  std::array<std::uint32_t, 5> m;
};

constexpr std::array<SobolDimension, kMaxSobolDimensions - 1> kSobol = {{{1, 0, {1}},
                                                                         {2, 1, {1, 3}},
                                                                         {3, 1, {1, 3, 1}},
                                                                         {3, 2, {1, 1, 1}},
                                                                         {4, 1, {1, 1, 3, 3}},
                                                                         {4, 4, {1, 3, 5, 13}},
                                                                         {5, 2, {1, 1, 5, 5, 17}}}};

/// v_1 ... v_32 as binary fractions of 32 bits.
std::array<std::uint32_t, kSobolBits> MakeDirections(int dimension) {
  std::array<std::uint32_t, kSobolBits> v{};
  if (dimension == 0) {
    for (int i = 0; i < kSobolBits; ++i) v[static_cast<size_t>(i)] = 1U << (kSobolBits - 1 - i);
    return v;
  }
  const SobolDimension& row = kSobol[static_cast<size_t>(dimension - 1)];
  const auto s = static_cast<size_t>(row.degree);
  for (size_t i = 0; i < kSobolBits; ++i) {
    if (i < s) {
      v[i] = row.m[i] << (kSobolBits - 1 - i);
      continue;
    }
    // m_i = 2 a_1 m_(i-1) ^ 4 a_2 m_(i-2) ^ ... ^ 2^s m_(i-s) ^ m_(i-s)
    v[i] = v[i - s] ^ (v[i - s] >> s);
    for (size_t k = 1; k < s; ++k) {
      if (((row.coefficients >> (s - 1 - k)) & 1U) != 0) v[i] ^= v[i - k];
    }
  }
  return v;
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

std::vector<UnitPoint> MakeSobol(int dimensions, long count) {
  Require(dimensions >= 1 && dimensions <= kMaxSobolDimensions, "dimensions", "must be from 1 to 8",
          dimensions);
  std::vector<UnitPoint> points(static_cast<size_t>(count), UnitPoint(static_cast<size_t>(dimensions)));
  for (int d = 0; d < dimensions; ++d) {
    const std::array<std::uint32_t, kSobolBits> v = MakeDirections(d);
    std::uint32_t x = 0;
    for (size_t i = 0; i < points.size(); ++i) {
      // Gray code: from point i - 1 to i one direction changes.
      if (i > 0) x ^= v[static_cast<size_t>(std::countr_zero(i))];
      points[i][static_cast<size_t>(d)] = static_cast<double>(x) * 0x1p-32;
    }
  }
  return points;
}

}  // namespace dexcheck
