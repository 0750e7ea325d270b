#pragma once

// What commands ask for that make many runs of one scenario and print one result.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "harness/cli/command_line.h"

namespace dexcheck::cli {

/// What is changed in a scenario.
struct Overrides {
  std::vector<std::string> set;    ///< "KEY=VALUE"
  std::vector<std::string> unset;  ///< "KEY"
  [[nodiscard]] bool empty() const { return set.empty() && unset.empty(); }
  /// As ParseScenario takes them: what is removed first.
  [[nodiscard]] std::vector<std::string> List() const;
};

/// Adds --set and --unset. @returns them.
std::array<Option, 2> AddOverrideOptions(Command command, Overrides* overrides);

/// Adds --jobs. @param what is made: "Trials". @param jobs 0 for one on each processor, as CountJobs reads
/// it.
Option AddJobsOption(Command command, const std::string& what, std::uint64_t* jobs);
int CountJobs(std::uint64_t jobs);

struct ScenarioRequest {
  std::string scenario;
  Overrides overrides;
  std::string json_file;
  bool quiet = false;
};

/// Adds SCENARIO, --set and --unset.
void AddScenarioOptions(Command command, ScenarioRequest* request);
/// Adds --json and --quiet. @param what the file gets: "the budget".
void AddResultOptions(Command command, const std::string& what, ScenarioRequest* request);

}  // namespace dexcheck::cli
