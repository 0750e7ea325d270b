#pragma once

// `dexcheck mutate --run SCENARIO`: faults in a run.

#include <cstdint>
#include <string>
#include <vector>

#include "harness/cli/commands.h"
#include "harness/run/run_mutation.h"

namespace dexcheck::cli {

struct MutateRunRequest {
  std::string scenario;
  Overrides overrides;
  RunMutationOptions options;
  std::string page_file;  ///< Empty for none.
  std::string json_file;
  std::uint64_t jobs = 0;  ///< Runs at a time; 0 for one on each processor.
  bool quiet = false;
};

/// Makes every fault, prints the table, writes the JSON. @returns the exit code: 1 when one was not found,
/// 3 when it was interrupted. @throws InputError.
int MutateRun(const MutateRunRequest& request);

}  // namespace dexcheck::cli
