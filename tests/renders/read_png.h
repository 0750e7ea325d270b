#pragma once

#include <cairo/cairo.h>

#include <filesystem>
#include <memory>

#include "controller/common/errors.h"
#include "renders/image.h"

namespace dexcheck::testing {

/// @throws InputError "PATH: cannot be read: reason".
inline Image ReadPng(const std::filesystem::path& path) {
  const std::shared_ptr<cairo_surface_t> surface(cairo_image_surface_create_from_png(path.c_str()),
                                                 cairo_surface_destroy);
  const cairo_status_t status = cairo_surface_status(surface.get());
  if (status != CAIRO_STATUS_SUCCESS)
    throw InputError(path.string() + ": cannot be read: " + cairo_status_to_string(status));
  Image image(cairo_image_surface_get_width(surface.get()), cairo_image_surface_get_height(surface.get()));
  CopySurface(surface.get(), &image);
  return image;
}

}  // namespace dexcheck::testing
