// Trials of a scenario that moves joints: what they come to.

#include "harness/study/trial.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "harness/study/study.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::trial_test {
namespace {

const std::string kText =
    "name = 'reach'\nscenario = 'panda-reach'\nset = ['duration=0.5', 'settle=0.1']\n"
    "[[vary]]\nkey = 'mismatch.mass.panda_link4'\nvalues = [1.0, 1.05, 3.0]\n";

TrialResult RunReach(double mass, const std::string& more = "") {
  StudyInputs inputs;
  inputs.study = ParseStudy(more + kText, "study.toml");
  inputs.scenario_folder = SourcePath("/harness/shipped/scenarios");
  inputs.scenario_source = "panda-reach.toml";
  inputs.scenario_text = ReadTextFile((inputs.scenario_folder / inputs.scenario_source).string());
  inputs.robot = SourcePath("/controller/parameters/panda.toml");
  inputs.mjcf = SourcePath("/mjcf/panda_scene.xml");
  return RunTrial(inputs, {0, 0, {mass}});
}

TEST(TrialOfJoints, HasTheErrorsOfTheRun) {
  const TrialResult trial = RunReach(1.05);
  ShippedRun run("panda-reach", {"duration=0.5", "settle=0.1", "mismatch.mass={ panda_link4 = 1.05 }"});
  const TrackingStatistics& tracking = run.Run().tracking;
  EXPECT_EQ(trial.metrics[kJointErrorRms], tracking.joints_rms());
  EXPECT_EQ(trial.metrics[kJointErrorMax], tracking.joints_max());
  EXPECT_GT(tracking.joints_rms(), 1e-4);
  EXPECT_GT(tracking.joints_max(), tracking.joints_rms());
  EXPECT_GT(trial.metrics[kPeakEffort], 0.0);
  EXPECT_GT(trial.metrics[kEnergy], 0.0);
  // Nothing is held.
  for (const Metric metric :
       {kPositionErrorRms, kPositionErrorMax, kOrientationErrorRms, kOrientationErrorMax, kConeMargin}) {
    EXPECT_TRUE(std::isnan(trial.metrics[metric])) << kMetrics[metric].name;
  }
  EXPECT_EQ(trial.outcome, Outcome::kTracked) << trial.failure;
  EXPECT_GT(trial.metrics[kJointErrorRms], 10.0 * RunReach(1.0).metrics[kJointErrorRms]);
}

TEST(TrialOfJoints, DivergesAndIsStoppedByTheErrorOfAJoint) {
  EXPECT_EQ(RunReach(3.0).outcome, Outcome::kDiverged);
  const TrialResult stopped = RunReach(3.0, "stop_error = 0.02\n");
  EXPECT_NE(stopped.failure.find("an error of a joint is above stop_error, 0.02 rad"), std::string::npos)
      << stopped.failure;
  EXPECT_LT(stopped.metrics[kSimulatedTime], 0.5);
}

// A trial sets its numbers in files that are parsed once: the same bits, and the same refusals, as from their
// text with "KEY=VALUE".
TEST(Trial, NumbersSetInParsedFilesAreThoseOfTheText) {
  StudyInputs text;
  text.study = ParseStudy(
      "name = 'mass'\nscenario = 'hold'\nset = ['duration=0.02', 'settle=0.05', 'model.object.mass=0.21']\n"
      "[[vary]]\nkey = 'model.base.wheels.damping'\nvalues = [0.02, 0.0312345678901234]\n"
      "[[vary]]\nkey = 'control.law'\nvalues = ['computed_torque', 'impedance']\n"
      "[[vary]]\nkey = 'actuation.delay'\nvalues = [0, 0.0012345678901234, -1]\n",
      "study.toml");
  text.scenario_folder = SourcePath("/harness/shipped/scenarios");
  text.scenario_source = "hold";
  text.scenario_text = ReadTextFile((text.scenario_folder / "hold.toml").string());
  text.robot = SourcePath("/controller/parameters/assistant_robot.toml");
  text.mjcf = SourcePath("/mjcf/scene.xml");
  StudyInputs parsed = text;
  parsed.study.variations.back().from = 0.0;  // whose ends must make a scenario
  CheckTrials(&parsed);
  ASSERT_TRUE(parsed.scenario_document && parsed.model_document);
  int refused = 0;
  for (const Trial& trial : ListTrials(text.study)) {
    const TrialResult a = RunTrial(text, trial);
    const TrialResult b = RunTrial(parsed, trial);
    EXPECT_EQ(a.outcome, b.outcome);
    EXPECT_EQ(a.failure, b.failure);
    EXPECT_EQ(std::memcmp(a.metrics.data(), b.metrics.data(), sizeof a.metrics), 0) << trial.number;
    refused += a.outcome == Outcome::kRefused ? 1 : 0;
  }
  EXPECT_EQ(refused, 4) << "delays below zero";
}

}  // namespace
}  // namespace dexcheck::testing::trial_test
