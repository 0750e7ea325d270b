#pragma once

// Random numbers by counter: one stream for each source, so that a source that is switched off does not
// change the numbers of the others.

#include <cmath>
#include <cstdint>
#include <random>
#include <string_view>

#include "controller/common/types.h"

namespace dexcheck {

/// Converts 64 random bits to a number in [0, 1), the same on every machine; the standard library's
/// distributions differ between machines.
inline double ToUnitInterval(std::uint64_t bits) { return static_cast<double>(bits >> 11U) * 0x1p-53; }
inline double DrawUnit(std::mt19937_64* random) { return ToUnitInterval((*random)()); }

/// Number k of a stream is a function of seed, name and k alone. Nothing is stored between calls.
class RandomStream {
 public:
  /// @param source name of the drawn quantity: "sensing.joint_noise".
  RandomStream(std::uint64_t seed, std::string_view source) : key_(Mix(seed + kGolden)) {
    for (const char c : source) key_ = Mix(key_ ^ static_cast<unsigned char>(c));
  }

  /// Returns number `k` of the `channel` (a joint, an axis), uniform in [0, 1).
  [[nodiscard]] double Uniform(std::uint64_t k, std::uint64_t channel = 0) const {
    return ToUnitInterval(Draw(2 * k, channel));
  }
  /// Uniform in [-1, 1).
  [[nodiscard]] double Symmetric(std::uint64_t k, std::uint64_t channel = 0) const {
    return 2.0 * Uniform(k, channel) - 1.0;
  }
  /// Normal with mean 0 and variance 1 (Box and Muller).
  [[nodiscard]] double Normal(std::uint64_t k, std::uint64_t channel = 0) const {
    // 1 - u lies in (0, 1], where the logarithm is finite.
    const double radius = std::sqrt(-2.0 * std::log(1.0 - Uniform(k, channel)));
    const double angle = ToUnitInterval(Draw(2 * k + 1, channel));
    return radius * std::cos(2.0 * kPi * angle);
  }

 private:
  static constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15U;

  /// The finalizer of SplitMix64: a bijection in which each bit of the input changes half of the output's.
  static constexpr std::uint64_t Mix(std::uint64_t x) {
    x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9U;
    x = (x ^ (x >> 27U)) * 0x94D049BB133111EBU;
    return x ^ (x >> 31U);
  }
  [[nodiscard]] std::uint64_t Draw(std::uint64_t k, std::uint64_t channel) const {
    return Mix(Mix(key_ + kGolden * (channel + 1)) + kGolden * (k + 1));
  }

  std::uint64_t key_;
};

}  // namespace dexcheck
