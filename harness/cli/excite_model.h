#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "harness/cli/commands.h"
#include "harness/recordings/motion_design.h"

namespace dexcheck::cli {

/// A motion for a robot of which a recording is to be made.
struct MotionRequest {
  std::filesystem::path model, mjcf, limits, columns;
  std::vector<std::filesystem::path> recorded;
  std::string motion_file, json_file;
  bool quiet = false;
  MotionDesignOptions options;
};

void AddMotionOptions(const Command& command, MotionRequest* request);
/// @return exit code.
int DesignMotionOfModel(MotionRequest request);

}  // namespace dexcheck::cli
