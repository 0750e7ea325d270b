#include "renders/picture_file.h"

#include <string>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/files.h"
#include "renders/cairo_surface.h"
#include "renders/video_writer.h"

namespace dexcheck {
namespace {

bool IsJpeg(const std::filesystem::path& path) {
  const std::string extension = ExtensionOf(path);
  return extension == ".jpg" || extension == ".jpeg";
}

std::string EncodePng(const Image& image, const PartialFile& file) {
  const auto append = [](void* bytes, const unsigned char* data, unsigned count) {
    static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), count);
    return CAIRO_STATUS_SUCCESS;
  };
  std::string bytes;
  const cairo_status_t status = cairo_surface_write_to_png_stream(ToSurface(image).get(), append, &bytes);
  if (status != CAIRO_STATUS_SUCCESS) file.Fail(cairo_status_to_string(status));
  return bytes;
}

}  // namespace

void RequirePictureName(const std::filesystem::path& path) {
  if (ExtensionOf(path) == ".png" || IsJpeg(path)) return;
  throw InputError(path.string() + ": cannot be written: a picture's name must end in .png, .jpg or .jpeg");
}

void WritePicture(const std::filesystem::path& path, const Image& image) {
  RequirePictureName(path);
  PartialFile file(path);
  if (IsJpeg(path)) {
    constexpr const char* kQuality = "2";  // 1 best, 31 worst
    Ffmpeg ffmpeg(
        file, image.width, image.height, 1,
        {"-frames:v", "1", "-pix_fmt", "yuvj444p", "-q:v", kQuality, "-c:v", "mjpeg", "-f", "mjpeg"});
    ffmpeg.Write(image);
    ffmpeg.Finish();
  } else {
    file.Write(EncodePng(image, file));
  }
  file.Commit();
}

Image ReadPng(const std::filesystem::path& path) {
  const SurfacePtr surface(cairo_image_surface_create_from_png(path.c_str()));
  const cairo_status_t status = cairo_surface_status(surface.get());
  if (status != CAIRO_STATUS_SUCCESS)
    throw InputError(path.string() + ": cannot be read: " + cairo_status_to_string(status));
  Image image(cairo_image_surface_get_width(surface.get()), cairo_image_surface_get_height(surface.get()));
  CopySurface(surface.get(), &image);
  return image;
}

}  // namespace dexcheck
