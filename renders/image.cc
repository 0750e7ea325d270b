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
    const std::uint16_t* sums = column_sums.data();
    for (int x = 0; x < width; ++x, out += 3, sums += 3 * n) {
      const unsigned half = area / 2;
      unsigned r = half;
      unsigned g = half;
      unsigned b = half;
      for (std::size_t k = 0; k < n; ++k) {
        r += sums[3 * k];
        g += sums[3 * k + 1];
        b += sums[3 * k + 2];
      }
      out[0] = static_cast<std::uint8_t>(r / area);
      out[1] = static_cast<std::uint8_t>(g / area);
      out[2] = static_cast<std::uint8_t>(b / area);
    }
  }
  return image;
}

namespace {

constexpr std::uint8_t kFrame[3] = {242, 245, 248};

void Copy(const Image& source, int x, int y, Image* target) {
  for (int row = 0; row < source.height; ++row) {
    const std::uint8_t* from = source.Pixel(0, row);
    std::copy(from, from + 3 * source.width, target->Pixel(x, y + row));
  }
}

void Fill(int x, int y, int width, int height, Image* image) {
  for (int row = y; row < y + height; ++row) {
    for (int column = x; column < x + width; ++column) {
      std::copy(std::begin(kFrame), std::end(kFrame), image->Pixel(column, row));
    }
  }
}

/// Pixels of a frame that is two wide at 720 rows.
int FrameWidth(const Image& image) {
  return std::max(1, static_cast<int>(std::lround(image.height / 360.0)));
}

}  // namespace

void PlaceInset(const Image& inset, Image* image) {
  const int frame = FrameWidth(*image);
  const int margin = static_cast<int>(std::lround(image->height / 36.0));
  const int x = image->width - margin - frame - inset.width;
  const int y = image->height - margin - frame - inset.height;
  Require(x >= frame && y >= frame, "inset", "must fit into the picture", inset.width);
  Fill(x - frame, y - frame, inset.width + 2 * frame, inset.height + 2 * frame, image);
  Copy(inset, x, y, image);
}

}  // namespace dexcheck
