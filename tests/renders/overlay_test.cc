#include "renders/overlay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>

namespace dexcheck::testing::overlay_test {
namespace {

TEST(FormatSi, KeepsOneToThreeDigitsBeforeThePoint) {
  EXPECT_EQ(FormatSi(1.24e-8, "m"), "12.4 nm");
  EXPECT_EQ(FormatSi(-3.5e-6, "rad"), "-3.50 \u00b5rad");
  EXPECT_EQ(FormatSi(0.25, "m"), "250 mm");
  EXPECT_EQ(FormatSi(2.0, "m"), "2.00 m");
  EXPECT_EQ(FormatSi(0.0, "m"), "0 m");
  EXPECT_EQ(FormatSi(9.996e-9, "m"), "10.0 nm");
  EXPECT_EQ(FormatSi(9.9996e-7, "m"), "1.00 \u00b5m");
  EXPECT_EQ(FormatSi(std::numeric_limits<double>::quiet_NaN(), "m"), "not finite");
}

/// How many pixels have a saturated colour with this channel far above the others.
int CountSaturated(const Image& image, int channel) {
  int count = 0;
  for (size_t i = 0; i < image.rgb.size(); i += 3) {
    const int value = image.rgb[i + static_cast<size_t>(channel)];
    int others = 0;
    for (size_t k = 0; k < 3; ++k) {
      if (static_cast<int>(k) != channel) others = std::max<int>(others, image.rgb[i + k]);
    }
    if (value > others + 60) ++count;
  }
  return count;
}

CheckRecord MakeCheck(const char* name, double value) {
  CheckRecord check;
  check.name = name;
  check.bound = 1e-6;
  check.Add(value, 0.0);
  return check;
}

OverlayState MakeState() {
  OverlayState state;
  state.title = "scenario";
  state.time = 1.0;
  for (const CheckCategory category : kCheckCategories) state.categories.emplace_back(category);
  for (const size_t asked : {0U, 3U, 4U}) state.categories[asked].Add(MakeCheck("a check", 1e-7));
  return state;
}

TEST(Overlay, DotsShowTheChecksThatPassAndFail) {
  Overlay overlay;
  OverlayState state = MakeState();
  Image good(900, 720);
  overlay.Draw(state, &good);
  // Three dots of radius 5.
  EXPECT_NEAR(CountSaturated(good, 1), 3 * 78, 40);
  EXPECT_EQ(CountSaturated(good, 0), 0);

  state.categories[3].Add(MakeCheck("another", 2e-6));
  Image bad(900, 720);
  overlay.Draw(state, &bad);
  EXPECT_NEAR(CountSaturated(bad, 1), 2 * 78, 30);
  EXPECT_NEAR(CountSaturated(bad, 0), 78, 15);

  state.categories[3].Add(MakeCheck("a third", std::numeric_limits<double>::infinity()));
  Image infinite(900, 720);
  overlay.Draw(state, &infinite);
  EXPECT_NEAR(CountSaturated(infinite, 0), 78, 15);
}

TEST(Overlay, ShortensATitleThatIsTooLong) {
  Overlay overlay;
  OverlayState state = MakeState();
  state.title = std::string(500, 'W') + "\u00b5";
  Image image(900, 720);
  overlay.Draw(state, &image);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 340; x < image.width; ++x) ASSERT_EQ(image.Pixel(x, y)[0], 0);
  }
}

}  // namespace
}  // namespace dexcheck::testing::overlay_test
