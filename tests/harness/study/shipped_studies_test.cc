// Every shipped study can be run; what trials share changes none.

#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "controller/common/toml_reader.h"
#include "harness/study/study_store.h"
#include "harness/study/trial.h"
#include "tests/common/paths.h"

namespace dexcheck::testing::shipped_studies_test {
namespace {

TEST(ShippedStudies, AreAccepted) {
  int count = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(testing::SourcePath("/harness/shipped/studies"))) {
    if (entry.path().extension() != ".toml") continue;
    ++count;
    StudyInputs inputs;
    inputs.study = ParseStudy(ReadTextFile(entry.path().string()), entry.path().string());
    EXPECT_EQ(inputs.study.name, entry.path().stem().string());
    inputs.scenario_folder = testing::SourcePath("/harness/shipped/scenarios");
    inputs.scenario_text =
        ReadTextFile((inputs.scenario_folder / (inputs.study.scenario + ".toml")).string());
    inputs.scenario_source = inputs.study.scenario;
    inputs.robot = testing::SourcePath("/controller/parameters/assistant_robot.toml");
    inputs.mjcf = testing::SourcePath("/mjcf/scene.xml");
    EXPECT_NO_THROW(CheckTrials(&inputs)) << entry.path();
  }
  EXPECT_GE(count, 8);
}

/// A trial is made the same way whether its study was prepared or not, bit for bit.
TEST(Trials, ShareNothingThatOneOfThemChanged) {
  StudyInputs alone;
  alone.study = ParseStudy(R"(name = "shared"
scenario = "hold"
set = ["duration=0.02", "settle=0.01"]
[[vary]]
key = "control.natural_frequency"
values = [5, 50]
[[vary]]
key = "model.object.mass"
values = [0.2, 0.21]
[[vary]]
key = "mismatch.mass.r_forearm"
values = [1, 1.1]
)",
                           "shared");
  alone.scenario_folder = testing::SourcePath("/harness/shipped/scenarios");
  alone.scenario_text = ReadTextFile((alone.scenario_folder / "hold.toml").string());
  alone.scenario_source = "hold";
  alone.robot = testing::SourcePath("/controller/parameters/assistant_robot.toml");
  alone.mjcf = testing::SourcePath("/mjcf/scene.xml");
  StudyInputs prepared = alone;
  CheckTrials(&prepared);
  ASSERT_TRUE(prepared.model_document && prepared.engine);
  EXPECT_FALSE(prepared.model) << "a key of the robot varies";
  std::set<double> errors;
  for (const Trial& trial : ListTrials(alone.study)) {
    const TrialRow row{trial, RunTrial(prepared, trial), "this"};
    EXPECT_TRUE(IsSame(row, {trial, RunTrial(alone, trial), "this"})) << trial.number;
    EXPECT_EQ(row.result.failure, "");
    errors.insert(row.result.metrics[kPositionErrorRms]);
  }
  EXPECT_EQ(errors.size(), 8U) << "each key counts";
}

}  // namespace
}  // namespace dexcheck::testing::shipped_studies_test
