// Results of trials; every shipped study can be run, and shared parts change no trial.

#include "harness/study/trial.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <set>

#include "tests/harness/run/shipped_run.h"
#include "tests/harness/study/study_fixture.h"

namespace dexcheck::testing::trial_test {
namespace {

const std::string kText =
    "name = 'reach'\nscenario = 'panda-reach'\nset = ['duration=0.5', 'settle=0.1']\n"
    "[[vary]]\nkey = 'mismatch.mass.panda_link4'\nvalues = [1.0, 1.05, 3.0]\n";

TrialResult RunReach(double mass, const std::string& more = "") {
  return RunTrial(MakeStudyInputs(more + kText), {0, 0, {mass}});
}

TEST(TrialOfJoints, HasTheErrorsOfTheRun) {
  const TrialResult trial = RunReach(1.05);
  ShippedRun run("panda-reach", {"duration=0.5", "settle=0.1", "mismatch.mass={ panda_link4 = 1.05 }"});
  const TrackingStatistics& tracking = run.Run().tracking;
  EXPECT_EQ(trial.metrics[kJointErrorRms], tracking.joints.rms());
  EXPECT_EQ(trial.metrics[kJointErrorMax], tracking.joints.max);
  EXPECT_GT(tracking.joints.rms(), 1e-4);
  EXPECT_GT(tracking.joints.max, tracking.joints.rms());
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

TEST(ShippedStudies, AreAccepted) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(SourcePath("/harness/shipped/studies"))) {
    if (entry.path().extension() != ".toml") continue;
    ++count;
    StudyInputs inputs = MakeStudyInputs(ReadTextFile(entry.path().string()));
    EXPECT_EQ(inputs.study.name, entry.path().stem().string());
    EXPECT_NO_THROW(CheckTrials(&inputs)) << entry.path();
  }
  EXPECT_GE(count, 7);
}

/// A trial is made the same way whether its study was prepared or not, bit for bit.
TEST(Trials, ShareNothingThatOneOfThemChanged) {
  const StudyInputs alone = MakeStudyInputs(R"(name = "shared"
scenario = "hold"
set = ["duration=0.02", "settle=0.01"]
[[vary]]
key = "control.natural_frequency"
values = [5, 50, -1]
[[vary]]
key = "model.object.mass"
values = [0.2, 0.21]
[[vary]]
key = "mismatch.mass.r_forearm"
values = [1, 1.1]
)");
  StudyInputs prepared = alone;
  prepared.study.variations[0].from = 5.0;  // whose ends must make a scenario
  CheckTrials(&prepared);
  ASSERT_TRUE(prepared.scenario_document && prepared.model && prepared.engine);
  std::set<double> errors;
  for (const Trial& trial : ListTrials(alone.study)) {
    const TrialRow row{trial, RunTrial(prepared, trial), "this"};
    EXPECT_TRUE(IsSame(row, {trial, RunTrial(alone, trial), "elsewhere"})) << trial.number;
    const bool is_refused = trial.parameters[0] < 0.0;
    EXPECT_EQ(row.result.outcome == Outcome::kRefused, is_refused) << row.result.failure;
    if (is_refused) continue;
    errors.insert(row.result.metrics[kPositionErrorRms]);
  }
  EXPECT_EQ(errors.size(), 8U) << "each key counts";
}

// A loop's margins cost more than a short trial: they are computed where the study asks for one.
TEST(Trial, HasMarginsWhereTheStudyAsks) {
  const std::string head = "name = 'm'\nscenario = 'panda-reach'\nset = ['duration=0.002']\n",
                    vary = "[[vary]]\nkey = 'control.natural_frequency'\nvalues = [10]\n";
  const auto gain_margin = [&](const std::string& more) {
    return RunTrial(MakeStudyInputs(head + more + vary), {0, 0, {10.0}}).metrics[kGainMargin];
  };
  EXPECT_TRUE(std::isnan(gain_margin("")));
  EXPECT_TRUE(std::isnan(gain_margin("constraints = ['peak_effort < 1']\n")));
  const double asked = gain_margin("metrics = ['gain_margin']\n");
  EXPECT_GT(asked, 1.0);
  EXPECT_EQ(gain_margin("constraints = ['2 < phase_margin']\n"), asked);
  EXPECT_EQ(gain_margin("[[objective]]\nmaximize = 'delay_margin'\n"), asked);
}

}  // namespace
}  // namespace dexcheck::testing::trial_test
