#pragma once

// What commands ask for that make many runs of one scenario and print one result.

#include <string>
#include <vector>

#include "harness/cli/command_line.h"

namespace dexcheck::cli {

struct ScenarioRequest {
  std::string scenario;
  std::vector<std::string> overrides;
  std::string json_file;
  bool quiet = false;
};

/// Adds SCENARIO and --set.
void AddScenarioOptions(Command command, ScenarioRequest* request);
/// Adds --json and --quiet. @param what the file gets: "the budget".
void AddResultOptions(Command command, const std::string& what, ScenarioRequest* request);

}  // namespace dexcheck::cli
