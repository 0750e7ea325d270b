#pragma once

// What of a run is seen in space: pictures and the replay of its page.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "harness/report/replay.h"
#include "harness/report/run_data.h"

namespace dexcheck {

/// A picture of the run.
struct Picture {
  std::filesystem::path file;  ///< PNG.
  std::string panel;           ///< Number in the paper, "11 (a)"; or empty.
  std::string title;
};

struct RunScene {
  std::vector<Picture> pictures;
  std::optional<ReplayData> replay;
};

/// The paper's Figure 11, robot and object at the run's beginning and end, and the replay. Empty when the log
/// has no positions of the engine.
/// @param folder gets the pictures' files.
/// @throws InputError that names the log and what is wrong with it.
RunScene MakeRunScene(const RunData& run, const std::filesystem::path& folder);

}  // namespace dexcheck
