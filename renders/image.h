#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

struct _cairo_surface;  // NOLINT(bugprone-reserved-identifier): Cairo chose this name

namespace dexcheck {

/// Red, green, blue, opacity, each from 0 to 1.
using Color = std::array<float, 4>;

/// RGB picture, 8 bits a channel, rows from top to bottom without padding.
struct Image {
  Image() = default;
  /// Black. @throws std::invalid_argument unless both sizes are positive.
  Image(int width, int height);

  [[nodiscard]] std::uint8_t* Pixel(int x, int y) { return rgb.data() + Offset(x, y); }
  [[nodiscard]] const std::uint8_t* Pixel(int x, int y) const { return rgb.data() + Offset(x, y); }

  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;  ///< 3 * width * height.

 private:
  [[nodiscard]] std::size_t Offset(int x, int y) const {
    return 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
  }
};

/// Averages squares of `factor` x `factor` pixels; rows of `source` run from bottom to top, as OpenGL reads
/// them.
/// @param source 3 * (factor * width) * (factor * height) bytes.
Image ReduceBottomUp(const std::uint8_t* source, int width, int height, int factor);

/// Puts a smaller picture with a thin frame into the lower right corner.
/// @throws std::invalid_argument when it does not fit.
void PlaceInset(const Image& inset, Image* image);

/// The picture as Cairo draws on it: four bytes a pixel, blue first.
std::shared_ptr<_cairo_surface> ToSurface(const Image& image);
/// @param image as large as the surface.
void CopySurface(_cairo_surface* surface, Image* image);

/// @throws InputError "PATH: cannot be written: ..." unless the name ends in the extension, in small or
/// capital letters. @param extension ".mp4" for a video, ".png" for a picture.
void RequireExtension(const std::filesystem::path& path, const char* extension);

/// Writes a PNG file, which appears whole or not at all.
/// @throws InputError "PATH: cannot be written: reason", or as RequireExtension.
void WritePng(const std::filesystem::path& path, const Image& image);

}  // namespace dexcheck
