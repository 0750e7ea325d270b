#pragma once

#include <filesystem>

#include "harness/recordings/channels.h"

namespace dexcheck {

/// Opens a recording by a file of columns (TOML).
/// @param frames in which it gives payloads and wrenches. @param columns the file of columns. @param
/// recording its file; empty where the file of columns names it.
/// @throws InputError, one line.
Recording OpenByColumns(const RobotModel& model, const LinkFrames& frames,
                        const std::filesystem::path& columns, const std::filesystem::path& recording);

}  // namespace dexcheck
