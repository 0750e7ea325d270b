// Mistakes made in a run on purpose are found, and their causes are named and measured.

#include "harness/run/run_mutation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing {
namespace {

using ::testing::HasSubstr;

const std::string kRobot = SourcePath("/controller/parameters/assistant_robot.toml");
const std::string kScene = SourcePath("/mjcf/scene.xml");
const auto kGoOn = [] { return false; };

/// A short campaign.
RunCampaign MakeCampaign(const RunMutationOptions& options, const char* scenario = "curve") {
  return {ReadShippedScenario(scenario, {"settle=0.2"}), kRobot, kScene, options, kGoOn};
}

/// How many of the campaign's mistakes came to what.
struct Count {
  int made = 0, killed = 0, cause = 0, part = 0, with_part = 0;
};

/// Makes those mistakes that are chosen.
template <typename Choose>
Count RunSome(RunCampaign* campaign, const Choose& choose) {
  Count count;
  for (size_t i = 0; i < campaign->mutants().size(); ++i) {
    const RunMutant& mutant = campaign->mutants()[i];
    if (!choose(mutant)) continue;
    EXPECT_TRUE(campaign->Run(i, kGoOn));
    ++count.made;
    count.killed += mutant.killed ? 1 : 0;
    count.cause += mutant.has_right_cause() ? 1 : 0;
    if (!mutant.killed || !mutant.has_right_cause() || !mutant.names_part) {
      std::cout << mutant.name << ": " << (mutant.killed ? NameOf(mutant.cause) : "survived") << ": "
                << mutant.evidence << " " << mutant.failure << "\n";
    }
    if (mutant.part.empty()) continue;
    ++count.with_part;
    count.part += mutant.has_right_cause() && mutant.names_part ? 1 : 0;
  }
  return count;
}

TEST(RunCampaign, FindsEveryWrongLawAndNamesThePart) {
  RunMutationOptions options;
  options.from = 1.0;
  options.duration = 0.02;
  options.parameters = 0;
  options.plants = false;
  for (const char* scenario : {"curve", "exercise"}) {
    SCOPED_TRACE(scenario);
    RunCampaign campaign = MakeCampaign(options, scenario);
    const Count laws = RunSome(&campaign, [](const RunMutant&) { return true; });
    EXPECT_GE(laws.made, 55);
    EXPECT_EQ(laws.killed, laws.made);
    EXPECT_EQ(laws.cause, laws.made);
    EXPECT_EQ(laws.with_part, 45);
    EXPECT_GE(laws.part, 43);
  }
}

TEST(RunCampaign, FindsFaultsOfPlantsAndTheirCauses) {
  RunMutationOptions options;
  options.from = 0.6;
  options.duration = 0.05;
  options.parameters = 3;
  options.laws = false;
  RunCampaign campaign = MakeCampaign(options);
  // Those that are there from the beginning take longest.
  const Count faults = RunSome(&campaign, [](const RunMutant& mutant) { return mutant.kind != "wheels"; });
  EXPECT_GE(faults.made, 60);
  EXPECT_GE(20 * faults.killed, 19 * faults.made);
  EXPECT_GE(20 * faults.cause, 19 * faults.made);
  EXPECT_GE(20 * faults.part, 19 * faults.with_part);
  for (const RunMutant& mutant : campaign.mutants())
    EXPECT_NE(mutant.cause, Cause::kIntegrator) << mutant.name;
}

TEST(RunCampaign, ARunThatDoesNotPassIsNoPlaceForMistakes) {
  RunMutationOptions options;
  options.from = 0.01;
  EXPECT_THROW(RunCampaign(ReadShippedScenario("curve", {"settle=0.1", "model.object.mass=0.21"}), kRobot,
                           kScene, options, kGoOn),
               InputError);
  EXPECT_THROW(RunCampaign(ReadShippedScenario("lift"), kRobot, kScene, options, kGoOn), InputError);
}

TEST(RunCampaign, WhatIsStoppedIsNotDone) {
  RunMutationOptions options;
  options.from = 0.01;
  options.parameters = 1;
  RunCampaign campaign = MakeCampaign(options);
  EXPECT_FALSE(campaign.Run(0, [] { return true; }));
}

}  // namespace
}  // namespace dexcheck::testing
