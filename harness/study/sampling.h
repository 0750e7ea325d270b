#pragma once

// Points of the unit cube at which a study looks, the same on every machine.

#include <cstdint>
#include <optional>
#include <vector>

#include "harness/study/study.h"

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
/// How many dimensions they may have.
int CountMostDimensions(const Sample& sample);

}  // namespace dexcheck
