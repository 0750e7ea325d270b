#pragma once

// libav for the writers of videos and pictures only, loaded when the first is written: objects that free
// themselves, failures as text.

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/opt.h>
#include <libswscale/swscale.h>
}

#include <memory>
#include <string>

namespace dexcheck::libav {

/// The functions that are called here, by library.
// clang-format off
#define DEXCHECK_AVUTIL(X)                                                                             \
  X(av_dict_free) X(av_dict_set) X(av_frame_alloc) X(av_frame_free) X(av_frame_get_buffer)             \
  X(av_frame_make_writable) X(av_log_set_level) X(av_opt_set) X(av_opt_set_int) X(av_rescale_q)        \
  X(av_strerror)
#define DEXCHECK_AVCODEC(X)                                                                            \
  X(av_packet_alloc) X(av_packet_free) X(av_packet_rescale_ts) X(avcodec_alloc_context3)               \
  X(avcodec_find_encoder) X(avcodec_find_encoder_by_name) X(avcodec_free_context) X(avcodec_open2)     \
  X(avcodec_parameters_from_context) X(avcodec_receive_packet) X(avcodec_send_frame)
#define DEXCHECK_AVFORMAT(X)                                                                           \
  X(av_interleaved_write_frame) X(av_write_trailer) X(avformat_alloc_output_context2)                  \
  X(avformat_free_context) X(avformat_new_stream) X(avformat_write_header) X(avio_closep) X(avio_open)
#define DEXCHECK_SWSCALE(X)                                                                            \
  X(sws_freeContext) X(sws_getCoefficients) X(sws_getContext) X(sws_scale) X(sws_setColorspaceDetails)
// clang-format on

struct Functions {
#define DEXCHECK_FUNCTION(name) decltype(&::name) name;
  DEXCHECK_AVUTIL(DEXCHECK_FUNCTION)
  DEXCHECK_AVCODEC(DEXCHECK_FUNCTION)
  DEXCHECK_AVFORMAT(DEXCHECK_FUNCTION)
  DEXCHECK_SWSCALE(DEXCHECK_FUNCTION)
#undef DEXCHECK_FUNCTION
};

/// libav keeps silent: messages come as exceptions instead.
/// @throws Error when a library is not there.
const Functions& Load();

struct Deleter {
  void operator()(AVCodecContext* object) const { Load().avcodec_free_context(&object); }
  void operator()(AVFrame* object) const { Load().av_frame_free(&object); }
  void operator()(AVPacket* object) const { Load().av_packet_free(&object); }
  void operator()(SwsContext* object) const { Load().sws_freeContext(object); }
  void operator()(AVFormatContext* object) const {
    if (object->pb != nullptr) Load().avio_closep(&object->pb);
    Load().avformat_free_context(object);
  }
};
using CodecPtr = std::unique_ptr<AVCodecContext, Deleter>;
using FramePtr = std::unique_ptr<AVFrame, Deleter>;
using PacketPtr = std::unique_ptr<AVPacket, Deleter>;
using SwsPtr = std::unique_ptr<SwsContext, Deleter>;
using FormatPtr = std::unique_ptr<AVFormatContext, Deleter>;

inline std::string Explain(int error) {
  char text[AV_ERROR_MAX_STRING_SIZE] = "";
  Load().av_strerror(error, text, sizeof(text));
  return text;
}

}  // namespace dexcheck::libav
