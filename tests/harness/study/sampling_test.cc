// Points of studies: even coverage, and the same on every machine.

#include "harness/study/sampling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace dexcheck::testing::sampling_test {
namespace {

/// Whether each of the `count` equal slices of an axis holds exactly one of the points.
bool FillsSlices(const std::vector<UnitPoint>& points, size_t axis) {
  std::set<long> slices;
  for (const UnitPoint& point : points) {
    if (point[axis] < 0.0 || point[axis] >= 1.0) return false;
    slices.insert(static_cast<long>(point[axis] * static_cast<double>(points.size())));
  }
  return slices.size() == points.size();
}

TEST(Sampling, LatinHypercubeFillsEverySliceOfEveryAxis) {
  const std::vector<UnitPoint> points = MakeLatinHypercube(5, 37, 3);
  ASSERT_EQ(points.size(), 37u);
  for (size_t axis = 0; axis < 5; ++axis) EXPECT_TRUE(FillsSlices(points, axis)) << axis;
  EXPECT_EQ(points, MakeLatinHypercube(5, 37, 3));
  EXPECT_NE(points, MakeLatinHypercube(5, 37, 4));
}

TEST(Sampling, SobolFillsEverySliceOfEveryAxis) {
  for (const long count : {2L, 16L, 256L, 4096L}) {
    const std::vector<UnitPoint> points = MakeSobol(kMaxSobolDimensions, count);
    for (size_t axis = 0; axis < kMaxSobolDimensions; ++axis) {
      EXPECT_TRUE(FillsSlices(points, axis)) << count << " points, axis " << axis;
    }
  }
}

// The first two dimensions are a (0, 2)-sequence: every dyadic box of the points' share holds one.
TEST(Sampling, SobolsFirstTwoDimensionsFillEveryDyadicBox) {
  constexpr int kBits = 8;
  const std::vector<UnitPoint> points = MakeSobol(2, 1L << kBits);
  for (int bits = 0; bits <= kBits; ++bits) {
    std::set<std::pair<long, long>> boxes;
    for (const UnitPoint& point : points) {
      boxes.emplace(static_cast<long>(point[0] * static_cast<double>(1L << bits)),
                    static_cast<long>(point[1] * static_cast<double>(1L << (kBits - bits))));
    }
    EXPECT_EQ(boxes.size(), points.size()) << bits;
  }
}

// Owen's scrambling moves every point and keeps what makes the sequence even.
TEST(Sampling, ScrambledSobolFillsEverySliceAndDependsOnItsSeed) {
  const std::vector<UnitPoint> points = MakeSobol(kMaxSobolDimensions, 1024, 5);
  for (size_t axis = 0; axis < kMaxSobolDimensions; ++axis) EXPECT_TRUE(FillsSlices(points, axis)) << axis;
  EXPECT_EQ(points, MakeSobol(kMaxSobolDimensions, 1024, 5));
  EXPECT_NE(points, MakeSobol(kMaxSobolDimensions, 1024, 6));
  std::set<std::pair<long, long>> boxes;
  for (const UnitPoint& point : points) {
    boxes.emplace(static_cast<long>(point[0] * 32.0), static_cast<long>(point[1] * 32.0));
  }
  EXPECT_EQ(boxes.size(), points.size()) << "each dyadic box holds one";
  // The mean of the product of all keys' tents, 1 by construction: even points are far nearer than random
  // ones.
  const auto mean = [](const std::vector<UnitPoint>& at) {
    double sum = 0.0;
    for (const UnitPoint& point : at) {
      double product = 1.0;
      for (size_t i = 0; i < 8; ++i) product *= (2.0 * std::abs(2.0 * point[i] - 1.0) + 1.0) / 2.0;
      sum += product;
    }
    return sum / static_cast<double>(at.size());
  };
  constexpr double kEven = 0.004;  // measured 0.0012; random points of this number scatter by 0.02
  EXPECT_NEAR(mean(points), 1.0, kEven);
}

// Worked by hand from v = 1/2, 1/4 and v = 1/2, 3/4 in Gray code's order.
TEST(Sampling, SobolsFirstPoints) {
  const std::vector<UnitPoint> expected = {{0, 0}, {0.5, 0.5}, {0.75, 0.25}, {0.25, 0.75}};
  EXPECT_EQ(MakeSobol(2, 4), expected);
}

}  // namespace
}  // namespace dexcheck::testing::sampling_test
