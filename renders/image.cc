#include "renders/image.h"

#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "controller/common/errors.h"
#include "harness/base/files.h"

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

namespace {

/// Calls act(the pixel of the picture, the same of the surface) for all of them; both are equally large.
template <typename SomeImage, typename Action>
void ForEachPixel(SomeImage& image, cairo_surface_t* surface, const Action& act) {
  cairo_surface_flush(surface);
  unsigned char* const data = cairo_image_surface_get_data(surface);
  const int stride = cairo_image_surface_get_stride(surface);
  for (int y = 0; y < image.height; ++y) {
    auto* pixel = image.Pixel(0, y);
    unsigned char* bgrx = data + static_cast<std::ptrdiff_t>(y) * stride;
    for (int x = 0; x < image.width; ++x, pixel += 3, bgrx += 4) act(pixel, bgrx);
  }
  cairo_surface_mark_dirty(surface);
}

}  // namespace

std::shared_ptr<cairo_surface_t> ToSurface(const Image& image) {
  std::shared_ptr<cairo_surface_t> surface(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, image.width, image.height), cairo_surface_destroy);
  ForEachPixel(image, surface.get(),
               [](const std::uint8_t* rgb, unsigned char* bgrx) { std::reverse_copy(rgb, rgb + 3, bgrx); });
  return surface;
}

void CopySurface(cairo_surface_t* surface, Image* image) {
  ForEachPixel(*image, surface,
               [](std::uint8_t* rgb, const unsigned char* bgrx) { std::reverse_copy(bgrx, bgrx + 3, rgb); });
}

void RequireExtension(const std::filesystem::path& path, const char* extension) {
  if (ExtensionOf(path) == extension) return;
  throw InputError(path.string() + ": cannot be written: the name must end in " + extension);
}

void WritePng(const std::filesystem::path& path, const Image& image) {
  RequireExtension(path, ".png");
  PartialFile file(path);
  const auto append = [](void* bytes, const unsigned char* data, unsigned count) {
    static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), count);
    return CAIRO_STATUS_SUCCESS;
  };
  std::string bytes;
  const cairo_status_t status = cairo_surface_write_to_png_stream(ToSurface(image).get(), append, &bytes);
  if (status != CAIRO_STATUS_SUCCESS) file.Fail(cairo_status_to_string(status));
  file.Write(bytes);
  file.Commit();
}

}  // namespace dexcheck
