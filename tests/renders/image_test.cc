#include "renders/image.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "tests/common/throws.h"

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

TEST(Image, RefusesEmptyPictures) {
  EXPECT_TRUE(
      Throws<std::invalid_argument>([] { return Image(0, 3); }, "image width: must be positive, got 0"));
  EXPECT_TRUE(Throws<std::invalid_argument>([] { return Image(3, -1); }, "image height"));
}

Image MakePlain(int width, int height, std::uint8_t value) {
  Image image(width, height);
  std::ranges::fill(image.rgb, value);
  return image;
}

TEST(PlaceInset, LiesInTheLowerRightCornerWithAFrame) {
  Image image = MakePlain(640, 360, 10);
  PlaceInset(MakePlain(100, 50, 20), &image);
  // At 360 rows the frame is 1 wide, the margin 10.
  const int right = 640 - 10;
  const int bottom = 360 - 10;
  EXPECT_EQ(image.Pixel(right - 2, bottom - 2)[0], 20);
  EXPECT_EQ(image.Pixel(right - 101, bottom - 51)[0], 20);
  EXPECT_EQ(image.Pixel(right - 1, bottom - 1)[0], 242);
  EXPECT_EQ(image.Pixel(right - 102, bottom - 52)[0], 242);
  EXPECT_EQ(image.Pixel(right, bottom)[0], 10);
  EXPECT_EQ(image.Pixel(right - 103, bottom - 53)[0], 10);
}

TEST(PlaceInset, RefusesWhatDoesNotFit) {
  Image image(100, 100);
  EXPECT_TRUE(Throws<std::invalid_argument>([&] { PlaceInset(Image(100, 20), &image); }, "inset: must fit"));
}

}  // namespace
}  // namespace dexcheck::testing::image_test
