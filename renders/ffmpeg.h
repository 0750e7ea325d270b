#pragma once

// The program ffmpeg, which encodes pictures and videos.

#include <optional>
#include <string>
#include <vector>

#include "harness/base/child_process.h"
#include "harness/base/partial_file.h"
#include "renders/image.h"

namespace dexcheck {

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

}  // namespace dexcheck
