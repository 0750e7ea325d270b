#pragma once

#include <filesystem>
#include <string>

#include "harness/engine/engine.h"
#include "harness/log/log_reader.h"
#include "renders/run_frames.h"

namespace dexcheck {

/// Where the robot ("robot") or the model ("mjcf") that a log names lies, once its files are unpacked.
/// @throws InputError when the log holds no such file, or the model names files outside its folder.
std::filesystem::path FindEmbedded(const LogReader& log, const std::string& kind,
                                   const std::filesystem::path& unpacked);

/// A recorded run, ready to be drawn.
struct RecordedFrames {
  MjModelPtr model;  ///< From the MJCF that the log keeps.
  RunFrames frames;
};

/// From a log, or from RUN_DIR/log.h5. Only time, engine/qpos and the MJCF must be there; what else is
/// missing is not drawn.
/// @throws InputError that names the log and what is wrong with it.
RecordedFrames ReadRecordedFrames(const LogReader& log);
RecordedFrames ReadRecordedFrames(const std::filesystem::path& run_folder);

}  // namespace dexcheck
