#include "renders/video_writer.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/opt.h>
#include <libswscale/swscale.h>
}

#include <cerrno>

#include "controller/common/errors.h"
#include "harness/common/partial_file.h"

namespace dexcheck {
namespace {

template <typename T, void (*kFree)(T**)>
struct AvDeleter {
  void operator()(T* object) const { kFree(&object); }
};
using CodecPtr = std::unique_ptr<AVCodecContext, AvDeleter<AVCodecContext, avcodec_free_context>>;
using FramePtr = std::unique_ptr<AVFrame, AvDeleter<AVFrame, av_frame_free>>;
using PacketPtr = std::unique_ptr<AVPacket, AvDeleter<AVPacket, av_packet_free>>;

struct SwsDeleter {
  void operator()(SwsContext* context) const { sws_freeContext(context); }
};
using SwsPtr = std::unique_ptr<SwsContext, SwsDeleter>;

struct FormatDeleter {
  void operator()(AVFormatContext* context) const {
    if (context->pb != nullptr) avio_closep(&context->pb);
    avformat_free_context(context);
  }
};
using FormatPtr = std::unique_ptr<AVFormatContext, FormatDeleter>;

std::string Explain(int error) {
  char text[AV_ERROR_MAX_STRING_SIZE] = "";
  av_strerror(error, text, sizeof(text));
  return text;
}

void CheckOptions(const VideoOptions& options) {
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
  Require(options.threads >= 1, "encoder threads", "must be positive", options.threads);
}

}  // namespace

class VideoWriter::Impl {
 public:
  Impl(const std::filesystem::path& path, const VideoOptions& options)
      : options_((CheckOptions(options), options)), file_(path) {
    // Messages come as exceptions instead.
    av_log_set_level(AV_LOG_QUIET);
    OpenEncoder();
    OpenFile();
    converter_.reset(sws_getContext(options.width, options.height, AV_PIX_FMT_RGB24, options.width,
                                    options.height, AV_PIX_FMT_YUV420P, SWS_BILINEAR, nullptr, nullptr,
                                    nullptr));
    if (!converter_) file_.Fail("no colour conversion");
    const int* to_bt709 = sws_getCoefficients(SWS_CS_ITU709);
    constexpr int kUnity = 1 << 16;
    sws_setColorspaceDetails(converter_.get(), to_bt709, 1, to_bt709, 0, 0, kUnity, kUnity);
    frame_.reset(av_frame_alloc());
    frame_->format = AV_PIX_FMT_YUV420P;
    frame_->width = options.width;
    frame_->height = options.height;
    Check(av_frame_get_buffer(frame_.get(), 0));
    packet_.reset(av_packet_alloc());
  }

  void Write(const Image& image) {
    Require(image.width == options_.width, "frame width", "must be the video's", image.width);
    Require(image.height == options_.height, "frame height", "must be the video's", image.height);
    Check(av_frame_make_writable(frame_.get()));
    const std::uint8_t* source[1] = {image.rgb.data()};
    const int stride[1] = {3 * image.width};
    sws_scale(converter_.get(), source, stride, 0, image.height, frame_->data, frame_->linesize);
    frame_->pts = frames_++;
    Encode(frame_.get());
  }

  void Finish() {
    if (frames_ == 0) file_.Fail("there are no frames");
    Encode(nullptr);
    Check(av_write_trailer(format_.get()));
    Check(avio_closep(&format_->pb));
    file_.Commit();
  }

  [[nodiscard]] long frames() const { return frames_; }

 private:
  void Check(int result) const {
    if (result < 0) file_.Fail(Explain(result));
  }

  void OpenEncoder() {
    const AVCodec* codec = avcodec_find_encoder_by_name("libx264");
    if (codec == nullptr) file_.Fail("libavcodec was built without libx264");
    encoder_.reset(avcodec_alloc_context3(codec));
    encoder_->width = options_.width;
    encoder_->height = options_.height;
    encoder_->pix_fmt = AV_PIX_FMT_YUV420P;
    encoder_->time_base = {1, options_.fps};
    encoder_->framerate = {options_.fps, 1};
    encoder_->gop_size = 2 * options_.fps;
    encoder_->thread_count = options_.threads;
    encoder_->color_range = AVCOL_RANGE_MPEG;
    encoder_->color_primaries = AVCOL_PRI_BT709;
    encoder_->color_trc = AVCOL_TRC_BT709;
    encoder_->colorspace = AVCOL_SPC_BT709;
    // MP4 keeps the stream's parameters in its header; the same frames give the same bytes.
    encoder_->flags |= AV_CODEC_FLAG_GLOBAL_HEADER | AV_CODEC_FLAG_BITEXACT;
    Check(av_opt_set(encoder_->priv_data, "preset", options_.preset.c_str(), 0));
    // Otherwise x264 picks code by processor, and its AVX-512 code gives varying bytes for the same frames.
    Check(av_opt_set(encoder_->priv_data, "x264-params", "cpu-independent=1", 0));
    Check(av_opt_set_int(encoder_->priv_data, "crf", options_.quality, 0));
    Check(avcodec_open2(encoder_.get(), codec, nullptr));
  }

  void OpenFile() {
    const std::string url = "file:" + file_.partial().string();
    AVFormatContext* format = nullptr;
    Check(avformat_alloc_output_context2(&format, nullptr, "mp4", url.c_str()));
    format_.reset(format);
    format_->flags |= AVFMT_FLAG_BITEXACT;
    stream_ = avformat_new_stream(format_.get(), nullptr);
    if (stream_ == nullptr) file_.Fail("no stream");
    stream_->time_base = encoder_->time_base;
    stream_->avg_frame_rate = encoder_->framerate;
    Check(avcodec_parameters_from_context(stream_->codecpar, encoder_.get()));
    Check(avio_open(&format_->pb, url.c_str(), AVIO_FLAG_WRITE));
    AVDictionary* options = nullptr;
    av_dict_set(&options, "movflags", "+faststart", 0);
    const int result = avformat_write_header(format_.get(), &options);
    av_dict_free(&options);
    Check(result);
  }

  /// @param frame null when there are no more.
  void Encode(const AVFrame* frame) {
    Check(avcodec_send_frame(encoder_.get(), frame));
    for (;;) {
      const int result = avcodec_receive_packet(encoder_.get(), packet_.get());
      if (result == AVERROR(EAGAIN) || result == AVERROR_EOF) return;
      Check(result);
      av_packet_rescale_ts(packet_.get(), encoder_->time_base, stream_->time_base);
      packet_->stream_index = stream_->index;
      packet_->duration = av_rescale_q(1, encoder_->time_base, stream_->time_base);
      Check(av_interleaved_write_frame(format_.get(), packet_.get()));
      Check(format_->pb->error);
    }
  }

  VideoOptions options_;
  PartialFile file_;
  CodecPtr encoder_;
  FormatPtr format_;
  AVStream* stream_ = nullptr;  // of format_
  SwsPtr converter_;
  FramePtr frame_;
  PacketPtr packet_;
  long frames_ = 0;
};

VideoWriter::VideoWriter(const std::filesystem::path& path, const VideoOptions& options)
    : impl_(std::make_unique<Impl>(path, options)) {}

VideoWriter::~VideoWriter() = default;

void VideoWriter::Write(const Image& image) { impl_->Write(image); }

void VideoWriter::Finish() { impl_->Finish(); }

long VideoWriter::frames() const { return impl_->frames(); }

}  // namespace dexcheck
