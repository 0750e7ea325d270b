#pragma once

// libav for the writers of films and pictures only: objects that free themselves, failures as text.

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libswscale/swscale.h>
}

#include <memory>
#include <string>

namespace dexcheck::libav {

template <typename T, void (*kFree)(T**)>
struct Deleter {
  void operator()(T* object) const { kFree(&object); }
};
using CodecPtr = std::unique_ptr<AVCodecContext, Deleter<AVCodecContext, avcodec_free_context>>;
using FramePtr = std::unique_ptr<AVFrame, Deleter<AVFrame, av_frame_free>>;
using PacketPtr = std::unique_ptr<AVPacket, Deleter<AVPacket, av_packet_free>>;

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

inline std::string Explain(int error) {
  char text[AV_ERROR_MAX_STRING_SIZE] = "";
  av_strerror(error, text, sizeof(text));
  return text;
}

}  // namespace dexcheck::libav
