#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/common/run_program.h"

namespace dexcheck::testing {

/// The frames of a video or picture in 24-bit RGB, one after another, as ffmpeg decodes them.
inline std::string Decode(const std::filesystem::path& path) {
  const ProgramResult decoded =
      RunProgram({DEXCHECK_FFMPEG, "-v", "error", "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"});
  EXPECT_EQ(decoded.exit_code, 0) << decoded.err;
  return decoded.out;
}

}  // namespace dexcheck::testing
