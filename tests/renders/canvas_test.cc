// Shapes and text against their areas and places.

#include "renders/canvas.h"

#include <gtest/gtest.h>

#include <array>
#include <utility>

#include "controller/common/errors.h"
#include "tests/common/paths.h"
#include "tests/common/throws.h"

namespace dexcheck::testing::canvas_test {
namespace {

const Color kWhite = MakeColor(0xffffff);

// Rounding of a sum of thousands of terms.
constexpr double kRounding = 1e-10;

/// Sum of what was drawn in white on black, in pixels.
double Area(const Image& image) {
  double sum = 0.0;
  for (const std::uint8_t value : image.rgb) sum += value / (3.0 * 255.0);
  return sum;
}

TEST(Canvas, MakesColorsFromHexadecimal) {
  const Color color = MakeColor(0xff8000, 0.5F);
  EXPECT_FLOAT_EQ(color[0], 1.0F);
  EXPECT_FLOAT_EQ(color[1], 128.0F / 255.0F);
  EXPECT_FLOAT_EQ(color[2], 0.0F);
  EXPECT_FLOAT_EQ(color[3], 0.5F);
}

TEST(Canvas, FillsAndMixes) {
  Image image(20, 20);
  Canvas(&image).FillRoundedRectangle({4.0, 5.0}, {8.0, 6.0}, 0.0, kWhite);
  EXPECT_NEAR(Area(image), 48.0, kRounding);
  Canvas(&image).FillRoundedRectangle({0.0, 0.0}, {4.0, 4.0}, 0.0, MakeColor(0x204080, 0.5F));
  for (const auto& [channel, value] : {std::pair(0, 16), std::pair(1, 32), std::pair(2, 64)})
    EXPECT_NEAR(image.Pixel(1, 1)[channel], value, 1);
}

TEST(Canvas, CutsOffWhatIsOutside) {
  Image image(8, 8);
  {
    Canvas canvas(&image);
    canvas.FillRoundedRectangle({-100.0, -100.0}, {300.0, 300.0}, 5.0, kWhite);
    const std::array<Vector2d, 2> away = {Vector2d(-50.0, -10.0), Vector2d(1e6, -10.0)};
    canvas.StrokePath(away, 3.0, MakeColor(0x000000));
    canvas.FillCircle({1e9, -1e9}, 5.0, MakeColor(0x000000));
    canvas.DrawText(Font(Font::SystemFolder() / "DejaVuSans.ttf"), 20.0, {-500.0, 4.0}, "outside",
                    MakeColor(0x000000));
  }
  EXPECT_NEAR(Area(image), 64.0, kRounding);
}

TEST(Canvas, TextStandsWhereItIsAligned) {
  Font font(Font::SystemFolder() / "DejaVuSans.ttf");
  const double width = font.Measure("12.4 \u00b5m", 20.0);
  ASSERT_GT(width, 60.0);
  ASSERT_LT(width, 100.0);
  for (const auto& [align, left] :
       {std::pair(Canvas::Align::kLeft, 150.0), std::pair(Canvas::Align::kCenter, 150.0 - 0.5 * width),
        std::pair(Canvas::Align::kRight, 150.0 - width)}) {
    Image image(300, 40);
    Canvas(&image).DrawText(font, 20.0, {150.0, 28.0}, "12.4 \u00b5m", kWhite, align);
    int first = 300;
    int last = -1;
    for (int x = 0; x < 300; ++x) {
      for (int y = 0; y < 40; ++y) {
        if (image.Pixel(x, y)[0] < 128) continue;
        first = std::min(first, x);
        last = std::max(last, x);
      }
    }
    // The first glyph begins, and the last one ends, up to two pixels inside of its advance.
    EXPECT_NEAR(first, left, 3.0);
    EXPECT_NEAR(last, left + width, 3.0);
  }
}

TEST(Font, BrokenUtf8IsMended) {
  Font font(Font::SystemFolder() / "DejaVuSans.ttf");
  EXPECT_GT(font.Measure("\xff\xc3", 20.0), 0.0);
  EXPECT_EQ(font.Measure("", 20.0), 0.0);
}

TEST(Font, NamesAFileThatIsNone) {
  EXPECT_TRUE(Throws<InputError>([] { Font font("/nowhere/font.ttf"); },
                                 "/nowhere/font.ttf: cannot be used as a font"));
  EXPECT_TRUE(Throws<InputError>([] { Font font(SourcePath("/README.md")); }, "cannot be used as a font"));
}

}  // namespace
}  // namespace dexcheck::testing::canvas_test
