// Margins of an arm's loops: the run itself is stable just inside and unstable just outside.

#include "harness/run/joint_margins.h"

#include <gtest/gtest.h>

#include <deque>

#include "tests/harness/run/changed_parts.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::joint_margins_test {
namespace {

/// The Panda stays where it starts but for small sines: the linear loop is that of this posture.
std::unique_ptr<Setup> MakeStandingPanda(const std::vector<std::string>& keys) {
  std::vector<std::string> all = {
      "duration=3",
      "expect={}",
      "control.natural_frequency=40",
      "control.damping_ratio=0.7",
      "joint_motion.points=[]",
      "actuation.limit=1e4",
      "joint_motion.oscillations=[{ joint = 'panda_joint2', amplitude_deg = 0.2, frequency = 3 }, { joint = "
      "'panda_joint6', amplitude_deg = 0.2, frequency = 4 }]"};
  all.insert(all.end(), keys.begin(), keys.end());
  const Scenario scenario = ReadShippedScenario("panda-reach", all);
  return std::make_unique<Setup>(scenario, scenario.model_file, scenario.mjcf_file);
}

using Change = ChangedController::Change;

/// Whether the errors of the joints stay as they are, and no larger than some times the sines.
bool IsStable(const std::vector<std::string>& keys, const Change& change = {}) {
  const std::unique_ptr<Setup> setup = MakeStandingPanda(keys);
  LoopParts parts = MakeLoopParts(*setup);
  if (change) parts.controller = std::make_unique<ChangedController>(std::move(parts.controller), change);
  Runner runner(*setup, /*check=*/false, std::move(parts));
  double early = 0.0, late = 0.0;
  const RunResult& result = runner.Run(
      [&](const StepRecord& step) {
        if (step.time > 0.5 && step.time < 1.0) early = std::max(early, step.error.joints);
        if (step.time > 2.5) late = std::max(late, step.error.joints);
      },
      [] { return false; });
  return result.failure.empty() && late < 2.0 * early && result.tracking.joints.max < 0.03;
}

JointMargins FindMarginsOf(const std::vector<std::string>& keys) {
  const std::unique_ptr<Setup> setup = MakeStandingPanda(keys);
  return CalcJointMargins(*setup, setup->joints()->gains).value();
}

Eigen::Index FindEntry(const std::string& joint) { return joint.back() - '1'; }

/// One joint's torque times a factor, but for the weight at the start, which would only move the arm.
Change Strengthen(const std::string& joint, double factor) {
  return [=, i = FindEntry(joint), weight = VectorXd()](const GraspModel& model, Command* command) mutable {
    if (weight.size() == 0) weight = model.robot().gravity();
    command->tau[i] = weight[i] + factor * (command->tau[i] - weight[i]);
  };
}

/// One joint's torque later by a time, the others as they are.
Change Delay(const std::string& joint, double delay) {
  return [entry = FindEntry(joint), steps = delay / 1e-3, sent = std::deque<double>()](
             const GraspModel&, Command* command) mutable {
    double& tau = command->tau[entry];
    const auto whole = static_cast<size_t>(steps);
    if (sent.empty()) sent.assign(whole + 2, tau);
    sent.push_front(tau);
    sent.pop_back();
    const double fraction = steps - static_cast<double>(whole);
    tau = (1.0 - fraction) * sent[whole] + fraction * sent[whole + 1];
  };
}

class JointMarginsOfARun : public ::testing::TestWithParam<const char*> {
 protected:
  std::vector<std::string> keys_ = {std::string("control.law=") + GetParam()};
};

constexpr double kInside = 0.94, kOutside = 1.06;

TEST_P(JointMarginsOfARun, AreWhereOneTorqueTurns) {
  const JointMargins margins = FindMarginsOf(keys_);
  ASSERT_TRUE(margins.is_stable());
  ASSERT_TRUE(IsStable(keys_));
  EXPECT_TRUE(IsStable(keys_, Strengthen(margins.gain_joint, kInside * margins.least.gain)));
  EXPECT_FALSE(IsStable(keys_, Strengthen(margins.gain_joint, kOutside * margins.least.gain)));
  EXPECT_TRUE(IsStable(keys_, Delay(margins.delay_joint, kInside * margins.least.delay)));
  EXPECT_FALSE(IsStable(keys_, Delay(margins.delay_joint, kOutside * margins.least.delay)));
}

TEST_P(JointMarginsOfARun, AreWhereAllTorquesTurn) {
  const JointMargins margins = FindMarginsOf(keys_);
  const auto late = [&](double part) {
    std::vector<std::string> keys = keys_;
    keys.push_back("actuation.delay=" + std::to_string(part * margins.together.delay));
    return keys;
  };
  EXPECT_TRUE(IsStable(late(kInside)));
  EXPECT_FALSE(IsStable(late(kOutside)));
  // The delay that the scenario already has is subtracted.
  EXPECT_NEAR(FindMarginsOf(late(0.5)).together.delay, 0.5 * margins.together.delay,
              0.01 * margins.together.delay);
  EXPECT_FALSE(FindMarginsOf(late(kOutside)).is_stable());
}

INSTANTIATE_TEST_SUITE_P(Laws, JointMarginsOfARun,
                         ::testing::Values("computed_torque", "pd_gravity", "feedforward_pd"),
                         [](const auto& info) { return std::string(info.param); });

TEST(JointMargins, BestGainsLeaveEnoughAndNotMore) {
  const auto setup = MakeStandingPanda({"actuation.delay=0.004"});
  const BestGains best = FindBestGains(*setup);
  const auto enough = [&](double factor) {
    const StabilityMargins least =
        CalcJointMargins(*setup, ScaleGains(setup->joints()->gains, factor)).value().least;
    return least.gain >= BestGains::kGain && least.phase >= BestGains::kPhase;
  };
  EXPECT_TRUE(enough(best.factor));
  EXPECT_FALSE(enough(1.02 * best.factor));
  EXPECT_NE(best.limited_by.find("margin of panda_joint"), std::string::npos);
  // From gains that are too high it comes down to the same.
  const auto high = MakeStandingPanda({"actuation.delay=0.004", "control.natural_frequency=400"});
  EXPECT_NEAR(FindBestGains(*high).factor, 0.1 * best.factor, 0.02 * 0.1 * best.factor);
}

TEST(JointMargins, TheCardIsTheScenariosControl) {
  const auto setup =
      MakeStandingPanda({"control={ law = 'feedforward_pd', natural_frequency = { all = 20, panda_joint7 = "
                         "30 }, damping_ratio = 0.7, stiffness = 50, coulomb = { all = 0.1 } }"});
  EXPECT_EQ(
      WriteJointControl(setup->scenario(), 1.0),
      "[control]\nlaw = \"feedforward_pd\"\n"
      "natural_frequency = { \"all\" = 20, \"panda_joint7\" = 30 }\ndamping_ratio = 0.7\nstiffness = 50\n"
      "coulomb = { \"all\" = 0.1 }\ncoulomb_velocity = 0.01\n");
  // It may stand in the scenario's place.
  const std::string text = setup->scenario().text;
  const size_t from = text.find("[control]"), to = text.find("[expect]");
  const Scenario again =
      ParseScenario(text.substr(0, from) + WriteJointControl(setup->scenario(), 1.5) + "\n" + text.substr(to),
                    setup->scenario().source, testing::SourcePath("/harness/shipped/scenarios"), {});
  EXPECT_EQ(again.joint_task()->natural_frequency.groups.front().second, 30.0);
  EXPECT_EQ(again.joint_task()->stiffness.all, 112.0);
}

}  // namespace
}  // namespace dexcheck::testing::joint_margins_test
