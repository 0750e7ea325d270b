#pragma once

// Points of the unit cube at which a study looks, the same on every machine.

#include <cstdint>
#include <vector>

namespace dexcheck {

/// Coordinates in [0, 1), one for each dimension.
using UnitPoint = std::vector<double>;

/// `count` points of a Latin hypercube: each of the `count` equal slices of every axis holds one, at a place
/// within it that the seed decides.
std::vector<UnitPoint> MakeLatinHypercube(int dimensions, long count, std::uint64_t seed);

/// Largest number of dimensions of MakeSobol.
constexpr int kMaxSobolDimensions = 8;

/// The first `count` points of the Sobol sequence with the direction numbers of Joe and Kuo (2008); it begins
/// with the origin.
std::vector<UnitPoint> MakeSobol(int dimensions, long count);

}  // namespace dexcheck
