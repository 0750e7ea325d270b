#include "renders/picture_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/files.h"
#include "harness/base/partial_file.h"
#include "renders/libav.h"
#include "renders/png_file.h"

namespace dexcheck {
namespace {

bool IsJpeg(const std::filesystem::path& path) {
  const std::string extension = ExtensionOf(path);
  return extension == ".jpg" || extension == ".jpeg";
}

/// The picture as a JPEG file's bytes. @throws libav's reason through `file`.
std::string EncodeJpeg(const Image& image, const PartialFile& file) {
  const auto check = [&](int result) {
    if (result < 0) file.Fail(libav::Explain(result));
  };
  const libav::Functions& av = libav::Load();
  const AVCodec* const codec = av.avcodec_find_encoder(AV_CODEC_ID_MJPEG);
  if (codec == nullptr) file.Fail("libavcodec was built without JPEG");
  const libav::CodecPtr encoder(av.avcodec_alloc_context3(codec));
  encoder->width = image.width;
  encoder->height = image.height;
  encoder->pix_fmt = AV_PIX_FMT_YUVJ444P;
  encoder->color_range = AVCOL_RANGE_JPEG;
  encoder->time_base = {1, 1};
  encoder->thread_count = 1;
  constexpr int kQuality = 2;  // 1 best, 31 worst
  encoder->flags |= AV_CODEC_FLAG_QSCALE | AV_CODEC_FLAG_BITEXACT;
  encoder->global_quality = FF_QP2LAMBDA * kQuality;
  check(av.avcodec_open2(encoder.get(), codec, nullptr));

  const libav::FramePtr frame(av.av_frame_alloc());
  frame->format = encoder->pix_fmt;
  frame->width = image.width;
  frame->height = image.height;
  frame->quality = encoder->global_quality;
  frame->pts = 0;
  check(av.av_frame_get_buffer(frame.get(), 0));
  const libav::SwsPtr converter(av.sws_getContext(image.width, image.height, AV_PIX_FMT_RGB24, image.width,
                                                  image.height, encoder->pix_fmt, SWS_BILINEAR, nullptr,
                                                  nullptr, nullptr));
  if (!converter) file.Fail("no colour conversion");
  const std::uint8_t* source[1] = {image.rgb.data()};
  const int stride[1] = {3 * image.width};
  av.sws_scale(converter.get(), source, stride, 0, image.height, frame->data, frame->linesize);

  check(av.avcodec_send_frame(encoder.get(), frame.get()));
  const libav::PacketPtr packet(av.av_packet_alloc());
  check(av.avcodec_receive_packet(encoder.get(), packet.get()));
  return {reinterpret_cast<const char*>(packet->data), static_cast<size_t>(packet->size)};
}

void WriteJpeg(const std::filesystem::path& path, const Image& image) {
  PartialFile target(path);
  const std::string bytes = EncodeJpeg(image, target);
  std::FILE* const file = std::fopen(target.partial().c_str(), "wb");
  if (file == nullptr) target.Fail(std::strerror(errno));
  const bool written = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
  const int error = errno;
  if (std::fclose(file) != 0) target.Fail(std::strerror(errno));
  if (!written) target.Fail(std::strerror(error));
  target.Commit();
}

}  // namespace

void RequirePictureName(const std::filesystem::path& path) {
  if (ExtensionOf(path) == ".png" || IsJpeg(path)) return;
  throw InputError(path.string() + ": cannot be written: a picture's name must end in .png, .jpg or .jpeg");
}

void WritePicture(const std::filesystem::path& path, const Image& image) {
  RequirePictureName(path);
  if (IsJpeg(path)) {
    WriteJpeg(path, image);
  } else {
    WritePng(path, image);
  }
}

}  // namespace dexcheck
