#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "harness/base/child_process.h"
#include "harness/base/files.h"
#include "renders/image.h"

namespace dexcheck {

// The program ffmpeg, which encodes pictures and videos.

/// Takes pictures and writes them into a file.
class Ffmpeg {
 public:
  /// @param fps pictures a second. @param encoding ffmpeg's arguments between input and output.
  /// @param file that is written; it must outlive this and is committed by the caller.
  Ffmpeg(const PartialFile& file, int width, int height, int fps, const std::vector<std::string>& encoding);
  ~Ffmpeg();
  Ffmpeg(const Ffmpeg&) = delete;
  Ffmpeg& operator=(const Ffmpeg&) = delete;

  /// @throws InputError "PATH: cannot be written: reason"; as Finish.
  void Write(const Image& image);
  void Finish();

 private:
  [[noreturn]] void Fail();
  void CloseInput();

  const PartialFile& file_;
  FileDescriptor input_;  // this end of what ffmpeg reads
  MessageFile messages_;
  std::optional<ChildProcess> process_;
};

struct EncodingOptions {
  int width = 1280;  ///< Even.
  int height = 720;  ///< Even.
  int fps = 30;      ///< Frames a second.
};

/// H.264 in MP4, VP9 in WebM (both yuv420p, BT.709), and GIF, which has 256 colours and plays without end.
enum class VideoFormat { kMp4, kWebm, kGif };

/// Times in a GIF are hundredths of a second, and viewers slow down what has less than two of them a frame.
inline constexpr int kMostGifFramesPerSecond = 50;

/// By the name's extension, in small or capital letters.
/// @throws InputError "PATH: cannot be written: ..." when it is none of theirs.
VideoFormat FindVideoFormat(const std::filesystem::path& path);

/// Writes a video that browsers play (an MP4 while it loads: its index stands before the data), frame by
/// frame, in the format that its name says. The file appears under its name when it is finished; until then,
/// and after an error, there is nothing.
class VideoWriter {
 public:
  /// @throws InputError "PATH: cannot be written: reason".
  /// @throws std::invalid_argument for sizes or rates that the format cannot take.
  VideoWriter(const std::filesystem::path& path, const EncodingOptions& options);

  /// Appends a frame of the options' size. @throws InputError as the constructor.
  void Write(const Image& image);
  /// Completes the file. @throws InputError as the constructor, also when there was no frame.
  void Finish();

  [[nodiscard]] long frames() const { return frames_; }

 private:
  PartialFile file_;
  EncodingOptions options_;
  Ffmpeg ffmpeg_;
  long frames_ = 0;
};

/// @throws InputError unless the name ends in .png, .jpg or .jpeg, in small or capital letters.
void RequirePictureName(const std::filesystem::path& path);

/// Writes a PNG or a JPEG (4:4:4, quality about 95), as the name says. The file appears whole or not at all.
/// @throws InputError "PATH: cannot be written: reason", or as RequirePictureName.
void WritePicture(const std::filesystem::path& path, const Image& image);

/// @throws InputError "PATH: cannot be read: reason".
Image ReadPng(const std::filesystem::path& path);

}  // namespace dexcheck
