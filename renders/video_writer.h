#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "renders/image.h"

namespace dexcheck {

struct VideoOptions {
  int width = 1280;                 ///< Even.
  int height = 720;                 ///< Even.
  int fps = 30;                     ///< Frames a second.
  int quality = 21;                 ///< x264's constant rate factor: 0 lossless, 51 worst.
  int threads = 1;                  ///< Of the encoder.
  std::string preset = "veryfast";  ///< x264's trade of time for size.
};

/// Writes an H.264 MP4 (yuv420p, BT.709, index before the data) that browsers play while it loads, frame by
/// frame. The file appears under its name when it is finished; until then, and after an error, there is
/// nothing.
class VideoWriter {
 public:
  /// @throws InputError "PATH: cannot be written: reason".
  /// @throws std::invalid_argument for sizes or rates that H.264 cannot take.
  VideoWriter(const std::filesystem::path& path, const VideoOptions& options);
  /// Removes what was written unless Finish was called.
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  /// Appends a frame of the options' size. @throws InputError as the constructor.
  void Write(const Image& image);
  /// Completes the file. @throws InputError as the constructor, also when there was no frame.
  void Finish();

  [[nodiscard]] long frames() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dexcheck
