#pragma once

// Pictures as Cairo draws on them: four bytes a pixel, blue first.

#include <cairo.h>

#include <cstddef>
#include <memory>

#include "renders/image.h"

namespace dexcheck {

struct SurfaceDeleter {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
using SurfacePtr = std::unique_ptr<cairo_surface_t, SurfaceDeleter>;

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

inline SurfacePtr ToSurface(const Image& image) {
  SurfacePtr surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, image.width, image.height));
  ForEachPixel(image, surface.get(), [](const std::uint8_t* rgb, unsigned char* bgrx) {
    bgrx[0] = rgb[2];
    bgrx[1] = rgb[1];
    bgrx[2] = rgb[0];
  });
  return surface;
}

/// @param image as large as the surface.
inline void CopySurface(cairo_surface_t* surface, Image* image) {
  ForEachPixel(*image, surface, [](std::uint8_t* rgb, const unsigned char* bgrx) {
    rgb[0] = bgrx[2];
    rgb[1] = bgrx[1];
    rgb[2] = bgrx[0];
  });
}

}  // namespace dexcheck
