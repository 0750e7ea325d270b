#pragma once

// Campaigns of faults in shipped scenarios.

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "harness/run/run_mutation.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing {

inline const auto kGoOn = [] { return false; };

/// @param scenario that settles for a short time where its robot is the paper's.
inline RunCampaign MakeCampaign(const RunMutationOptions& options, const std::string& scenario = "curve",
                                std::vector<std::string> overrides = {}) {
  const bool is_papers = ReadShippedScenario(scenario).model_file.empty();
  if (is_papers) overrides.insert(overrides.begin(), "settle=0.2");
  const Scenario read = ReadShippedScenario(scenario, overrides);
  return {read, is_papers ? SourcePath("/controller/parameters/assistant_robot.toml") : read.model_file,
          is_papers ? SourcePath("/mjcf/scene.xml") : read.mjcf_file, options, kGoOn};
}

/// Makes those faults that are chosen. @returns them, with what became of each.
inline std::vector<const RunMutant*> RunChosen(RunCampaign* campaign,
                                               const std::function<bool(const RunMutant&)>& choose) {
  std::vector<const RunMutant*> made;
  for (size_t i = 0; i < campaign->mutants().size(); ++i) {
    if (!choose(campaign->mutants()[i])) continue;
    EXPECT_TRUE(campaign->Run(i, kGoOn));
    made.push_back(&campaign->mutants()[i]);
  }
  return made;
}

}  // namespace dexcheck::testing
