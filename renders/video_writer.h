#pragma once

#include <filesystem>
#include <optional>

#include "harness/base/child_process.h"
#include "harness/base/files.h"
#include "renders/image.h"

namespace dexcheck {

struct EncodingOptions {
  int width = 1280;  ///< Even.
  int height = 720;  ///< Even.
  int fps = 30;      ///< Frames a second.
};

/// @throws InputError "PATH: cannot be written: ..." unless the name ends in the extension, in small or
/// capital letters. @param extension ".mp4" for a video, ".png" for a picture.
void RequireExtension(const std::filesystem::path& path, const char* extension);

/// Writes a video that browsers play while it loads, frame by frame: H.264 (yuv420p, BT.709) in MP4, whose
/// index stands before the data. The program ffmpeg encodes it. The file appears under its name when it is
/// finished; until then, and after an error, there is nothing.
class VideoWriter {
 public:
  /// @throws InputError "PATH: cannot be written: reason".
  /// @throws std::invalid_argument for sizes or rates that the format cannot take.
  VideoWriter(const std::filesystem::path& path, const EncodingOptions& options);
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  /// Appends a frame of the options' size. @throws InputError as the constructor.
  void Write(const Image& image);
  /// Completes the file. @throws InputError as the constructor, also when there was no frame.
  void Finish();

  [[nodiscard]] long frames() const { return frames_; }

 private:
  void CloseInput();
  void FinishEncoding();

  PartialFile file_;
  EncodingOptions options_;
  FileDescriptor input_;  // this end of what ffmpeg reads
  MessageFile messages_;
  std::optional<ChildProcess> process_;
  long frames_ = 0;
};

/// Writes a PNG file, which appears whole or not at all.
/// @throws InputError "PATH: cannot be written: reason", or as RequireExtension.
void WritePng(const std::filesystem::path& path, const Image& image);

/// @throws InputError "PATH: cannot be read: reason".
Image ReadPng(const std::filesystem::path& path);

}  // namespace dexcheck
