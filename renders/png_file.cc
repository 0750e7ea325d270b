#include "renders/png_file.h"

#include <png.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "controller/common/errors.h"
#include "harness/base/partial_file.h"

namespace dexcheck {
namespace {

struct FileCloser {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using FilePtr = std::unique_ptr<std::FILE, FileCloser>;

/// Frees what libpng holds for a picture.
struct PngImage : png_image {
  PngImage() : png_image{} { version = PNG_IMAGE_VERSION; }
  ~PngImage() { png_image_free(this); }
  PngImage(const PngImage&) = delete;
  PngImage& operator=(const PngImage&) = delete;
};

}  // namespace

void WritePng(const std::filesystem::path& path, const Image& image) {
  PartialFile target(path);
  FilePtr file(std::fopen(target.partial().c_str(), "wb"));
  if (!file) target.Fail(std::strerror(errno));
  PngImage png;
  png.width = static_cast<png_uint_32>(image.width);
  png.height = static_cast<png_uint_32>(image.height);
  png.format = PNG_FORMAT_RGB;
  errno = 0;
  if (png_image_write_to_stdio(&png, file.get(), 0, image.rgb.data(), 3 * image.width, nullptr) == 0) {
    target.Fail(errno != 0 ? std::strerror(errno) : png.message);
  }
  if (std::fflush(file.get()) != 0) target.Fail(std::strerror(errno));
  file.reset();
  target.Commit();
}

Image ReadPng(const std::filesystem::path& path) {
  const auto fail = [&](const char* reason) {
    throw InputError(path.string() + ": cannot be read: " + reason);
  };
  PngImage png;
  if (png_image_begin_read_from_file(&png, path.c_str()) == 0) fail(png.message);
  constexpr png_uint_32 kLargest = 16384;
  if (png.width > kLargest || png.height > kLargest) fail("the picture is too large");
  png.format = PNG_FORMAT_RGB;
  Image image(static_cast<int>(png.width), static_cast<int>(png.height));
  if (png_image_finish_read(&png, nullptr, image.rgb.data(), 0, nullptr) == 0) fail(png.message);
  return image;
}

}  // namespace dexcheck
