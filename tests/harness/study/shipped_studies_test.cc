// Every shipped study can be run.

#include <gtest/gtest.h>

#include <filesystem>

#include "controller/common/toml_reader.h"
#include "harness/study/trial.h"
#include "tests/common/paths.h"

namespace dexcheck::shipped_studies_test {
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

}  // namespace
}  // namespace dexcheck::shipped_studies_test
