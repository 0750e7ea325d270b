#include "renders/image.h"

#include <gtest/gtest.h>

#include <vector>

namespace dexcheck::testing::image_test {
namespace {

TEST(ReduceBottomUp, FlipsRowsWhenNothingIsToBeReduced) {
  const std::vector<std::uint8_t> source = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
  EXPECT_EQ(ReduceBottomUp(source.data(), 2, 2, 1).rgb,
            (std::vector<std::uint8_t>{7, 8, 9, 10, 11, 12, 1, 2, 3, 4, 5, 6}));
}

TEST(ReduceBottomUp, AveragesSquaresAndRounds) {
  // Two pixels of 2 x 2 each, the lower one first; red sums to 10 (mean 2.5), green to 400, blue to 4
  // (lower), 0 (upper).
  const std::vector<std::uint8_t> lower = {1, 100, 1, 2, 100, 1, 3, 100, 1, 4, 100, 1};
  const std::vector<std::uint8_t> upper = {255, 0, 0, 255, 0, 0, 255, 0, 0, 254, 0, 0};
  std::vector<std::uint8_t> source = lower;
  source.insert(source.end(), upper.begin(), upper.end());
  EXPECT_EQ(ReduceBottomUp(source.data(), 1, 2, 2).rgb, (std::vector<std::uint8_t>{255, 0, 0, 3, 100, 1}));
}

}  // namespace
}  // namespace dexcheck::testing::image_test
