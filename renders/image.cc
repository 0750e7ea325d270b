#include "renders/image.h"

#include <algorithm>
#include <cmath>

#include "controller/common/errors.h"

namespace dexcheck {

Image::Image(int w, int h) : width(w), height(h) {
  Require(w > 0, "image width", "must be positive", w);
  Require(h > 0, "image height", "must be positive", h);
  rgb.resize(3 * static_cast<std::size_t>(w) * static_cast<std::size_t>(h));
}

Image ReduceBottomUp(const std::uint8_t* source, int width, int height, int factor) {
  Require(factor >= 1 && factor <= 8, "reduction factor", "must be from 1 to 8", factor);
  Image image(width, height);
  const auto n = static_cast<std::size_t>(factor);
  const std::size_t source_row = 3 * n * static_cast<std::size_t>(width);
  const auto area = static_cast<unsigned>(factor * factor);
  std::vector<std::uint16_t> column_sums(source_row);
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* first = source + static_cast<std::size_t>(height - 1 - y) * n * source_row;
    std::copy(first, first + source_row, column_sums.begin());
    for (std::size_t k = 1; k < n; ++k) {
      const std::uint8_t* row = first + k * source_row;
      for (std::size_t i = 0; i < source_row; ++i) {
        column_sums[i] = static_cast<std::uint16_t>(column_sums[i] + row[i]);
      }
    }
    std::uint8_t* out = image.Pixel(0, y);
    for (std::size_t x = 0; x < static_cast<std::size_t>(width); ++x) {
      for (std::size_t channel = 0; channel < 3; ++channel) {
        unsigned sum = area / 2;
        for (std::size_t k = 0; k < n; ++k) sum += column_sums[3 * (n * x + k) + channel];
        *out++ = static_cast<std::uint8_t>(sum / area);
      }
    }
  }
  return image;
}

void PlaceInset(const Image& inset, Image* image) {
  constexpr std::uint8_t kFrame[3] = {242, 245, 248};
  // A frame is two pixels wide at 720 rows.
  const int frame = std::max(1, static_cast<int>(std::lround(image->height / 360.0)));
  const int margin = static_cast<int>(std::lround(image->height / 36.0));
  const int x = image->width - margin - frame - inset.width;
  const int y = image->height - margin - frame - inset.height;
  Require(x >= frame && y >= frame, "inset", "must fit into the picture", inset.width);
  for (int row = -frame; row < inset.height + frame; ++row) {
    for (int column = -frame; column < inset.width + frame; ++column)
      std::ranges::copy(kFrame, image->Pixel(x + column, y + row));
    if (row < 0 || row >= inset.height) continue;
    std::copy_n(inset.Pixel(0, row), 3 * inset.width, image->Pixel(x, y + row));
  }
}

}  // namespace dexcheck
