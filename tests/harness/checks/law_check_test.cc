// The question about the law: right torques pass to rounding, wrong ones are found and the wrong part is
// named.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/common/matchers.h"
#include "tests/harness/run/changed_parts.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::law_check_test {
namespace {

const std::vector<std::string> kShort = {"duration=0.8", "settle=0.2"};

TEST(LawCheck, TheRightLawPassesToRounding) {
  ShippedRun run("curve", kShort);
  const RunResult& result = run.Run();
  EXPECT_EQ(result.verdict, Verdict::kPass) << result.attribution.evidence;
  EXPECT_EQ(run.loop().checks().Find("law_torque").count, 800);
  for (const char* name : {"law_torque", "law_demand", "grasp_null_space", "grasp_cone", "grasp_optimality",
                           "torque_applied", "error_dynamics"}) {
    const CheckRecord& check = run.loop().checks().Find(name);
    EXPECT_LE(check.worst, 0.5 * check.bound) << name;
    EXPECT_GT(check.count, 0) << name;
  }
}

TEST(LawCheck, AnInternalForceThatIsNotTheBestIsFound) {
  const ShippedRun shipped("hold", {"duration=0.05", "settle=0.2"});
  LoopParts parts = MakeLoopParts(shipped.setup());
  // More internal force than is best: still in null(G), still in the cones.
  const ActuationMap actuation(shipped.setup().model());
  parts.controller = std::make_unique<ChangedController>(
      std::move(parts.controller), [&](const GraspModel& model, Command* command) {
        VectorXd force = model.grasp().J_B().transpose() * (0.05 * command->demand.F_N);
        actuation.CalcTorque(force, force);
        command->tau += force;
        command->demand.F_N *= 1.05;
      });
  const std::unique_ptr<Runner> runner = RunParts(shipped.setup(), std::move(parts));
  const RunResult& result = runner->result();
  EXPECT_EQ(result.attribution.cause, Cause::kControlLaw) << result.attribution.evidence;
  EXPECT_TRUE(runner->loop().checks().Find("grasp_optimality").failed);
  for (const char* name : {"grasp_null_space", "grasp_cone", "law_torque"})
    EXPECT_FALSE(runner->loop().checks().Find(name).failed) << name;
}

/// Motors that give another torque than they are sent, an object that accelerates otherwise than it says.
RunResult RunFaultyPlant(double gain, double acceleration, const char* check) {
  const ShippedRun shipped("hold", {"duration=0.2", "settle=0.2"});
  LoopParts parts = MakeLoopParts(shipped.setup());
  parts.plant = std::make_unique<ChangedPlant>(
      std::move(parts.plant), gain, [=](PlantResponse* response) { response->V_Bo_dot[0] += acceleration; });
  const std::unique_ptr<Runner> runner = RunParts(shipped.setup(), std::move(parts));
  EXPECT_TRUE(runner->loop().checks().Find(check).failed) << check;
  return runner->result();
}

TEST(LawCheck, TorquesThatDoNotArriveAreTheActuators) {
  const RunResult result = RunFaultyPlant(0.999, 0.0, "torque_applied");
  EXPECT_EQ(result.attribution.cause, Cause::kActuator);
  EXPECT_THAT(result.attribution.evidence, HasSubstr("all motors: gain 0.999"));
}

/// Returns the causes of torques of the joints' law to which this change is made.
Causes ExplainTorques(const std::function<void(const GraspModel& model, VectorXd* tau)>& change) {
  const ShippedRun shipped("panda-reach", {"duration=0.2", "settle=0.1", "expect.joints=1"});
  LoopParts parts = MakeLoopParts(shipped.setup());
  parts.controller = std::make_unique<ChangedController>(
      std::move(parts.controller),
      [&](const GraspModel& model, Command* command) { change(model, &command->tau); });
  return RunParts(shipped.setup(), std::move(parts))->result().causes;
}

TEST(LawCheck, ASmallTorqueIsNoZero) {
  const Causes causes = ExplainTorques([](const GraspModel&, VectorXd* tau) { (*tau)[3] += 1e-6; });
  ASSERT_FALSE(causes.empty());
  const auto& faults = causes.front().faults;  // so short a motion does not separate it from a factor
  const auto torque = std::ranges::find(faults, "torque", &Fault::fault);
  ASSERT_NE(torque, faults.end()) << causes.front().Describe();
  EXPECT_NEAR(torque->value, 1e-6, 1e-9) << causes.front().Describe();
  EXPECT_EQ(torque->place, "law of panda_joint4");
}

TEST(LawCheck, ASearchThatIsStoppedSaysSo) {
  const ShippedRun shipped("panda-reach", {"duration=0.05", "settle=0.1", "expect.joints=1"});
  LoopParts parts = MakeLoopParts(shipped.setup());
  parts.search.seconds = 0.0;
  parts.controller = std::make_unique<ChangedController>(
      std::move(parts.controller), [](const GraspModel&, Command* command) { command->tau[3] += 0.1; });
  const RunResult result = RunParts(shipped.setup(), std::move(parts))->result();
  EXPECT_EQ(result.attribution.cause, Cause::kControlLaw);
  EXPECT_THAT(result.attribution.evidence, HasSubstr("search for causes was stopped after 0 s"));
}

// A factor of all joints and one of a single joint are each reported in full.
TEST(LawCheck, FactorsOfAllJointsAndOfOneAreToldWhole) {
  const Causes causes = ExplainTorques([](const GraspModel& model, VectorXd* tau) {
    const VectorXd& gravity = model.robot().gravity();
    *tau -= 0.2 * gravity;
    (*tau)[1] -= 0.3 * gravity[1];
  });
  std::string told;
  for (const Explanation& one : causes) told += one.Describe() + "\n";
  EXPECT_THAT(told, HasSubstr("law of all but panda_joint2: gravity is multiplied by 0.8"));
  EXPECT_THAT(told, HasSubstr("law of panda_joint2: gravity is multiplied by 0.5"));
}

// Campaigns inject a law's faults by the table that names them; these come from the controller's terms alone.
TEST(LawCheck, FaultsFromOutsideTheTableAreNamed) {
  using Change = std::function<void(const GraspModel& model, VectorXd* tau)>;
  const std::vector<std::pair<Change, std::string>> faults = {
      {[](const GraspModel& model, VectorXd* tau) { *tau -= model.robot().gravity(); }, "gravity is missing"},
      {[](const GraspModel& model, VectorXd* tau) {
         *tau -= 2.0 * (model.robot().C() * model.robot().velocity());
       },
       "Coriolis forces have the other sign"},
      {[](const GraspModel& model, VectorXd* tau) {
         const MatrixXd& C = model.robot().C();
         *tau += (C.transpose() - C) * model.robot().velocity();
       },
       "Coriolis matrix transposed"},
      {[](const GraspModel&, VectorXd* tau) { std::swap((*tau)[5], (*tau)[6]); },
       "torques of panda_joint6 and panda_joint7 exchanged"},
      {[old = VectorXd()](const GraspModel&, VectorXd* tau) mutable {
         if (old.size() == 0) old = *tau;
         std::swap(old, *tau);
       },
       "torques of the step before"}};
  for (const auto& [change, name] : faults) {
    const Causes causes = ExplainTorques(change);
    const auto is_of_law = [](const Explanation& one) { return one.channel == CauseChannel::kLaw; };
    ASSERT_EQ(std::ranges::count_if(causes, is_of_law), 1)
        << name;  // torques may be above a motor's limit, too
    EXPECT_EQ(causes.front().outcome, CauseOutcome::kNamed);
    EXPECT_THAT(causes.front().Describe(), HasSubstr(name));
  }
}

/// A law whose gravity goes by another model.
class OtherGravity final : public Controller {
 public:
  OtherGravity(std::unique_ptr<Controller> law, RobotSpec spec)
      : law_(std::move(law)), model_(std::move(spec)), terms_(model_) {}
  void Follow(const Trajectory& motion) override { law_->Follow(motion); }
  void Begin(double t, const Reading& reading) override { law_->Begin(t, reading); }
  void Step(const Reading& reading, double t, Command* command) override {
    law_->Step(reading, t, command);
    terms_.SetState(reading.state.q, reading.state.xi);
    terms_.CalcDynamics();
    command->tau += terms_.gravity() - law_->model().robot().gravity();
  }
  const GraspModel& model() const override { return law_->model(); }

 private:
  std::unique_ptr<Controller> law_;
  RobotModel model_;
  ModelTerms terms_;
};

TEST(LawCheck, WhatIsWrongOfTheLawsModelIsNamed) {
  struct WrongModel {
    const char* fault;
    const char* place;
    void (*change)(RobotSpec* spec);
    double size;
  };
  const WrongModel kModels[] = {
      {"mass", "link panda_link4", [](RobotSpec* spec) { spec->joints[3].body.mass = 3.0; }, 3.0},
      {"centre of mass off by", "link panda_link3",
       [](RobotSpec* spec) { spec->joints[2].body.com += Vector3d(0.01, -0.02, 0.02); }, 0.03},
      {"place off by", "joint panda_joint4",
       [](RobotSpec* spec) { spec->joints[3].X_PB.pretranslate(Vector3d(0.0, 0.004, 0.003)); }, 0.005},
      {"turned by", "joint panda_joint5",
       [](RobotSpec* spec) { spec->joints[4].X_PB.rotate(Eigen::AngleAxisd(0.4, Vector3d::UnitY())); }, 0.4}};
  for (const WrongModel& wrong : kModels) {
    const ShippedRun shipped("panda-reach", {"duration=0.2", "settle=0.1", "expect.joints=1"});
    LoopParts parts = MakeLoopParts(shipped.setup());
    RobotSpec spec = shipped.setup().model().spec();
    wrong.change(&spec);
    parts.controller = std::make_unique<OtherGravity>(std::move(parts.controller), spec);
    const Causes causes = RunParts(shipped.setup(), std::move(parts))->result().causes;
    ASSERT_FALSE(causes.empty()) << wrong.fault;
    const auto is_it = [&](const Fault& fault) {
      return fault.fault == wrong.fault && fault.place.starts_with(wrong.place) &&
             std::abs(fault.value - wrong.size) < 1e-6;
    };
    EXPECT_NE(causes.front().outcome, CauseOutcome::kNotExplained) << causes.front().Describe();
    EXPECT_TRUE(std::ranges::any_of(causes.front().faults, is_it))
        << wrong.fault << causes.front().Describe();
  }
}

TEST(LawCheck, AnErrorThatDoesNotFollowIsFound) {
  EXPECT_NE(RunFaultyPlant(1.0, 1e-3, "error_dynamics").verdict, Verdict::kPass);
}

TEST(LawCheck, WhatAScenarioExpectsIsJudgedFromItsTimeOn) {
  for (const auto& [from, fails] : {std::pair{0.0, true}, std::pair{0.9, false}}) {
    ShippedRun run(
        "offset", {"expect.position=1e-6", "expect.orientation=1e-5", "expect.from=" + std::to_string(from)});
    const RunResult& result = run.Run();
    EXPECT_EQ(run.loop().checks().Find("expect_position").failed, fails);
    EXPECT_FALSE(run.loop().checks().Find("expect_orientation").failed);
    EXPECT_EQ(result.attribution.cause, fails ? Cause::kControlLaw : Cause::kNone)
        << result.attribution.evidence;
  }
  ShippedRun strict("offset", {"duration=0.05", "expect.orientation=1e-15", "expect.from=0"});
  EXPECT_NE(strict.Run().verdict, Verdict::kPass);
  EXPECT_TRUE(strict.loop().checks().Find("expect_orientation").failed);
}

TEST(LawCheck, GainsThatCannotSettleFailBeforeAnythingMoves) {
  for (const auto& [scenario, gain] :
       {std::pair{"curve", "control.natural_frequency=0"}, std::pair{"offset", "control.K_p=0"},
        std::pair{"offset", "control.K_p=-9"}}) {
    SCOPED_TRACE(gain);
    ShippedRun run(scenario, {gain, "duration=0.05", "settle=0.1"});
    const RunResult& result = run.Run();
    EXPECT_NE(result.verdict, Verdict::kPass);
    EXPECT_EQ(result.attribution.cause, Cause::kControlLaw);
    EXPECT_TRUE(run.loop().checks().Find("closed_loop_spectral_radius").failed);
    EXPECT_EQ(run.loop().checks().Find("closed_loop_spectral_radius").failed_at, 0.0);
  }
}

TEST(LawCheck, SampledRadiusIsThatOfTheRecursion) {
  ObjectGains gains;
  gains.K_v.setConstant(30.0);
  gains.K_p.setConstant(700.0);
  const double dt = 1e-3;
  for (const auto& [hold, age] : {std::pair(1L, 0.5 * dt), {4L, 0.5 * dt}, {1L, 0.0}, {4L, 0.0}}) {
    double e = 1.0, v = 0.3, u = 0.0;
    double last = 0.0;
    constexpr long kSteps = 4000;
    for (long i = 0; i < kSteps; ++i) {
      if (i % hold == 0) u = -30.0 * v - 700.0 * e;
      if (i == kSteps / 2) last = std::hypot(e, v);
      e += dt * (v + dt * u * (0.5 + age / dt));
      v += dt * u;
    }
    // The envelope of a damped oscillation: its phase leaves some hundredths over 2000 steps.
    const double measured = std::pow(std::hypot(e, v) / last, 2.0 / static_cast<double>(kSteps));
    EXPECT_NEAR(CalcSampledRadius(gains, dt, hold, age), measured, 3e-3) << hold;
  }
  gains.K_p.setZero();
  EXPECT_NEAR(CalcSampledRadius(gains, 1e-3, 1, 0.5e-3), 1.0, 1e-12);
  gains.K_v.setConstant(2100.0);
  EXPECT_GT(CalcSampledRadius(gains, 1e-3, 1, 0.5e-3), 1.0);
}

}  // namespace
}  // namespace dexcheck::testing::law_check_test
