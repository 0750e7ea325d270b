#pragma once

#include <filesystem>

#include "harness/engine/engine.h"
#include "renders/run_frames.h"

namespace dexcheck::cli {

/// A recorded run, ready to be drawn.
struct RecordedFrames {
  MjModelPtr model;  ///< From the MJCF that the log keeps.
  RunFrames frames;
};

/// Reads RUN_DIR/log.h5. Only time, engine/qpos and the MJCF must be there; what else is missing is not
/// drawn.
/// @throws InputError that names the log and what is wrong with it.
RecordedFrames ReadRecordedFrames(const std::filesystem::path& run_folder);

}  // namespace dexcheck::cli
