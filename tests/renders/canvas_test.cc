// Shapes and text against their areas and places.

#include <gtest/gtest.h>

#include <array>

#include "controller/common/errors.h"
#include "renders/overlay.h"
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
