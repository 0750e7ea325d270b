#include "renders/compose.h"

#include <algorithm>
#include <cmath>

#include "controller/common/errors.h"

namespace dexcheck {
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

Image PlaceBeside(const Image& left, const Image& right) {
  Require(left.height == right.height, "pictures side by side", "must be equally high", right.height);
  Image image(left.width + right.width, left.height);
  Copy(left, 0, 0, &image);
  Copy(right, left.width, 0, &image);
  const int width = FrameWidth(image);
  if (width < left.width && width < right.width) Fill(left.width - width / 2, 0, width, image.height, &image);
  return image;
}

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
