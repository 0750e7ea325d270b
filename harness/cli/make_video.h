#pragma once

#include <filesystem>
#include <string>

#include "renders/video.h"

namespace dexcheck::cli {

/// Reads "1280x720". @throws InputError unless both are even numbers that a picture can have.
void ReadSize(const std::string& text, int* width, int* height);

/// Draws a run into a video, with a progress bar, on all processors, at most 8. @return false when the user
/// stopped it; nothing is then written.
/// @throws InputError when a camera is unknown or the file cannot be written.
bool WriteVideo(const RunView& run, VideoOptions options, const std::string& out, bool quiet);

/// The video of a run as `dexcheck run --video` makes it: with contact forces.
bool WriteRunVideo(const std::filesystem::path& run_folder, const std::string& out, bool quiet);

}  // namespace dexcheck::cli
