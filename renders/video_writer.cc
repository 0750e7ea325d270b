#include "renders/video_writer.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <optional>

#include "controller/common/errors.h"
#include "harness/base/files.h"
#include "harness/base/partial_file.h"
#include "renders/libav.h"
#include "renders/palette.h"

namespace dexcheck {
namespace {

using libav::Explain;

/// How a format is made.
struct Recipe {
  const char* extension;
  const char* muxer;
  const char* encoder;
  AVPixelFormat pixels;
};

/// By VideoFormat.
constexpr std::array<Recipe, 3> kRecipes = {{{".mp4", "mp4", "libx264", AV_PIX_FMT_YUV420P},
                                             {".webm", "webm", "libvpx-vp9", AV_PIX_FMT_YUV420P},
                                             {".gif", "gif", "gif", AV_PIX_FMT_PAL8}}};

void CheckOptions(const EncodingOptions& options, VideoFormat format) {
  constexpr int kLargest = 16384;
  const auto check_size = [](const char* name, int value) {
    Require(value >= 2 && value <= kLargest && value % 2 == 0, name, "must be even and from 2 to 16384",
            value);
  };
  check_size("video width", options.width);
  check_size("video height", options.height);
  Require(options.fps >= 1 && options.fps <= 240, "frames a second", "must be from 1 to 240", options.fps);
  Require(options.quality >= 0 && options.quality <= 51, "video quality", "must be from 0 to 51",
          options.quality);
  Require(format != VideoFormat::kGif || options.fps <= kMostGifFramesPerSecond, "frames a second",
          "must be at most 50 in a GIF", options.fps);
  Require(options.threads >= 1, "encoder threads", "must be positive", options.threads);
}

}  // namespace

class VideoWriter::Impl {
 public:
  Impl(const std::filesystem::path& path, const EncodingOptions& options)
      : file_(path),
        kind_(FindVideoFormat(path)),
        recipe_(kRecipes[static_cast<size_t>(kind_)]),
        options_((CheckOptions(options, kind_), options)) {
    OpenEncoder();
    OpenFile();
    if (kind_ != VideoFormat::kGif) MakeConverter();
    frame_.reset(av_.av_frame_alloc());
    frame_->format = recipe_.pixels;
    frame_->width = options.width;
    frame_->height = options.height;
    Check(av_.av_frame_get_buffer(frame_.get(), 0));
    packet_.reset(av_.av_packet_alloc());
  }

  void Write(const Image& image) {
    Require(image.width == options_.width, "frame width", "must be the video's", image.width);
    Require(image.height == options_.height, "frame height", "must be the video's", image.height);
    Check(av_.av_frame_make_writable(frame_.get()));
    if (converter_) {
      const std::uint8_t* source[1] = {image.rgb.data()};
      const int stride[1] = {3 * image.width};
      av_.sws_scale(converter_.get(), source, stride, 0, image.height, frame_->data, frame_->linesize);
    } else {
      PaintWithPalette(image);
    }
    frame_->pts = frames_++;
    Encode(frame_.get());
  }

  void Finish() {
    if (frames_ == 0) file_.Fail("there are no frames");
    Encode(nullptr);
    Check(av_.av_write_trailer(format_.get()));
    Check(av_.avio_closep(&format_->pb));
    file_.Commit();
  }

  [[nodiscard]] long frames() const { return frames_; }

 private:
  void Check(int result) const {
    if (result < 0) file_.Fail(Explain(result));
  }

  /// RGB to YUV as high-definition video has it.
  void MakeConverter() {
    converter_.reset(av_.sws_getContext(options_.width, options_.height, AV_PIX_FMT_RGB24, options_.width,
                                        options_.height, recipe_.pixels, SWS_BILINEAR, nullptr, nullptr,
                                        nullptr));
    if (!converter_) file_.Fail("no colour conversion");
    const int* to_bt709 = av_.sws_getCoefficients(SWS_CS_ITU709);
    constexpr int kUnity = 1 << 16;
    av_.sws_setColorspaceDetails(converter_.get(), to_bt709, 1, to_bt709, 0, 0, kUnity, kUnity);
  }

  /// Fills the frame with numbers of colours; the first picture decides which colours there are.
  void PaintWithPalette(const Image& image) {
    if (!palette_) palette_.emplace(image);
    for (int row = 0; row < image.height; ++row) {
      const std::uint8_t* rgb = &image.rgb[static_cast<size_t>(row) * 3U * static_cast<size_t>(image.width)];
      std::uint8_t* const out = frame_->data[0] + static_cast<ptrdiff_t>(row) * frame_->linesize[0];
      for (int col = 0; col < image.width; ++col, rgb += 3) out[col] = palette_->Find(rgb);
    }
    // libav keeps a palette as 32-bit words, opaque black 0xff000000.
    auto* const words = reinterpret_cast<std::uint32_t*>(frame_->data[1]);
    for (size_t i = 0; i < Palette::kColors; ++i) {
      const Palette::Color& color = palette_->colors()[i];
      words[i] = 0xff000000U | static_cast<std::uint32_t>(color[0]) << 16U |
                 static_cast<std::uint32_t>(color[1]) << 8U | color[2];
    }
  }

  void OpenEncoder() {
    const AVCodec* codec = av_.avcodec_find_encoder_by_name(recipe_.encoder);
    if (codec == nullptr) file_.Fail(std::string("libavcodec was built without ") + recipe_.encoder);
    encoder_.reset(av_.avcodec_alloc_context3(codec));
    encoder_->width = options_.width;
    encoder_->height = options_.height;
    encoder_->pix_fmt = recipe_.pixels;
    encoder_->time_base = {1, options_.fps};
    encoder_->framerate = {options_.fps, 1};
    encoder_->gop_size = 2 * options_.fps;
    encoder_->thread_count = options_.threads;
    if (kind_ != VideoFormat::kGif) {
      encoder_->color_range = AVCOL_RANGE_MPEG;
      encoder_->color_primaries = AVCOL_PRI_BT709;
      encoder_->color_trc = AVCOL_TRC_BT709;
      encoder_->colorspace = AVCOL_SPC_BT709;
    }
    // The same frames give the same bytes; MP4 keeps the stream's parameters in its header.
    encoder_->flags |= AV_CODEC_FLAG_BITEXACT;
    if (kind_ == VideoFormat::kMp4) encoder_->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
    SetQuality();
    Check(av_.avcodec_open2(encoder_.get(), codec, nullptr));
  }

  void SetQuality() {
    void* const options = encoder_->priv_data;
    if (kind_ == VideoFormat::kMp4) {
      Check(av_.av_opt_set(options, "preset", options_.preset.c_str(), 0));
      // Otherwise x264 picks code by processor, and its AVX-512 code gives varying bytes for the same frames.
      Check(av_.av_opt_set(options, "x264-params", "cpu-independent=1", 0));
      Check(av_.av_opt_set_int(options, "crf", options_.quality, 0));
    } else if (kind_ == VideoFormat::kWebm) {
      // VP9's scale goes to 63, and looks the same some ten later.
      constexpr int kOffset = 10;
      encoder_->bit_rate = 0;
      Check(av_.av_opt_set_int(options, "crf", options_.quality + kOffset, 0));
      Check(av_.av_opt_set(options, "deadline", "good", 0));
      Check(av_.av_opt_set_int(options, "cpu-used", 5, 0));
    }
  }

  void OpenFile() {
    const std::string url = "file:" + file_.partial().string();
    AVFormatContext* format = nullptr;
    Check(av_.avformat_alloc_output_context2(&format, nullptr, recipe_.muxer, url.c_str()));
    format_.reset(format);
    format_->flags |= AVFMT_FLAG_BITEXACT;
    stream_ = av_.avformat_new_stream(format_.get(), nullptr);
    if (stream_ == nullptr) file_.Fail("no stream");
    stream_->time_base = encoder_->time_base;
    stream_->avg_frame_rate = encoder_->framerate;
    Check(av_.avcodec_parameters_from_context(stream_->codecpar, encoder_.get()));
    Check(av_.avio_open(&format_->pb, url.c_str(), AVIO_FLAG_WRITE));
    AVDictionary* options = nullptr;
    if (kind_ == VideoFormat::kMp4) av_.av_dict_set(&options, "movflags", "+faststart", 0);
    const int result = av_.avformat_write_header(format_.get(), &options);
    av_.av_dict_free(&options);
    Check(result);
  }

  /// @param frame null when there are no more.
  void Encode(const AVFrame* frame) {
    Check(av_.avcodec_send_frame(encoder_.get(), frame));
    for (;;) {
      const int result = av_.avcodec_receive_packet(encoder_.get(), packet_.get());
      if (result == AVERROR(EAGAIN) || result == AVERROR_EOF) return;
      Check(result);
      av_.av_packet_rescale_ts(packet_.get(), encoder_->time_base, stream_->time_base);
      packet_->stream_index = stream_->index;
      packet_->duration = av_.av_rescale_q(1, encoder_->time_base, stream_->time_base);
      Check(av_.av_interleaved_write_frame(format_.get(), packet_.get()));
      Check(format_->pb->error);
    }
  }

  const libav::Functions& av_ = libav::Load();
  PartialFile file_;
  VideoFormat kind_;
  const Recipe& recipe_;
  EncodingOptions options_;
  libav::CodecPtr encoder_;
  libav::FormatPtr format_;
  AVStream* stream_ = nullptr;      // of format_
  libav::SwsPtr converter_;         // none for a GIF
  std::optional<Palette> palette_;  // of a GIF, after its first picture
  libav::FramePtr frame_;
  libav::PacketPtr packet_;
  long frames_ = 0;
};

VideoFormat FindVideoFormat(const std::filesystem::path& path) {
  const std::string extension = ExtensionOf(path);
  const auto recipe = std::find_if(kRecipes.begin(), kRecipes.end(),
                                   [&](const Recipe& candidate) { return candidate.extension == extension; });
  if (recipe != kRecipes.end()) return static_cast<VideoFormat>(recipe - kRecipes.begin());
  throw InputError(path.string() + ": cannot be written: a video's name must end in .mp4, .webm or .gif");
}

VideoWriter::VideoWriter(const std::filesystem::path& path, const EncodingOptions& options)
    : impl_(std::make_unique<Impl>(path, options)) {}

VideoWriter::~VideoWriter() = default;

void VideoWriter::Write(const Image& image) { impl_->Write(image); }

void VideoWriter::Finish() { impl_->Finish(); }

long VideoWriter::frames() const { return impl_->frames(); }

}  // namespace dexcheck
