// The loop takes any plant and any controller, and its record tells what each was told and did.

#include <gtest/gtest.h>

#include <utility>

#include "harness/run/runner.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::loop_parts_test {
namespace {

/// A plant whose motors give another torque than they say.
class WeakPlant final : public Plant {
 public:
  WeakPlant(std::unique_ptr<Plant> plant, double gain) : plant_(std::move(plant)), gain_(gain) {}
  double time_step() const override { return plant_->time_step(); }
  std::span<const Motor> motors() const override { return plant_->motors(); }
  void BeginStep() override { plant_->BeginStep(); }
  void Read(PlantReading* reading) override { plant_->Read(reading); }
  void EndStep(const Eigen::Ref<const VectorXd>& tau) override { plant_->EndStep(gain_ * tau); }
  void Read(PlantResponse* response) override { plant_->Read(response); }
  void Place(const Eigen::Ref<const VectorXd>& q, const Pose& X_Bo) override { plant_->Place(q, X_Bo); }
  void AddVelocity(const MeasuredState& state, const Vector3d& v) override { plant_->AddVelocity(state, v); }
  void Translate(const Vector3d& way) override { plant_->Translate(way); }

 private:
  std::unique_ptr<Plant> plant_;
  double gain_;
};

/// A controller that sends another torque than its law's.
class WrongController final : public Controller {
 public:
  WrongController(std::unique_ptr<Controller> law, double gain) : law_(std::move(law)), gain_(gain) {}
  void Follow(const Trajectory& motion) override { law_->Follow(motion); }
  void Begin(double t, const Reading& reading) override { law_->Begin(t, reading); }
  void Step(const Reading& reading, double t, Command* command) override {
    law_->Step(reading, t, command);
    command->tau *= gain_;
  }
  const GraspModel& model() const override { return law_->model(); }

 private:
  std::unique_ptr<Controller> law_;
  double gain_;
};

class LoopPartsTest : public ::testing::Test {
 protected:
  LoopPartsTest() : shipped_("curve", {"duration=0.1"}), parts_(MakeLoopParts(shipped_.setup())) {}

  const StepRecord& Run() {
    runner_ = std::make_unique<Runner>(shipped_.setup(), /*check=*/true, std::move(parts_));
    runner_->Run([](const StepRecord&) {}, [] { return false; });
    return runner_->loop().record();
  }
  [[nodiscard]] double Worst(std::string_view check) const {
    return runner_->loop().checks().Find(check).worst;
  }

  ShippedRun shipped_;
  LoopParts parts_;
  std::unique_ptr<Runner> runner_;
};

TEST_F(LoopPartsTest, AnotherPlantOfTheSameKindGivesTheSameBits) {
  parts_.plant = std::make_unique<WeakPlant>(std::move(parts_.plant), 1.0);
  const StepRecord& step = Run();
  shipped_.Run();
  EXPECT_EQ(step.reading.qpos, shipped_.step().reading.qpos);
  EXPECT_EQ(step.command.tau, shipped_.step().command.tau);
  EXPECT_EQ(step.findings.xi_dot_model, shipped_.step().findings.xi_dot_model);
}

TEST_F(LoopPartsTest, MotorsThatGiveLessThanTheySayAreFound) {
  parts_.plant = std::make_unique<WeakPlant>(std::move(parts_.plant), 0.999);
  const StepRecord& step = Run();
  EXPECT_EQ(runner_->result().verdict, Verdict::kDisagreement) << runner_->result().failure;
  EXPECT_GT(Worst("inverse_dynamics_robot"), 1e-4);
  EXPECT_GT((step.response.motor_torques - step.drive.tau).norm(), 5e-4 * step.drive.tau.norm());
}

TEST_F(LoopPartsTest, AWrongLawMovesTheObjectButIsNoFaultOfTheModel) {
  parts_.controller = std::make_unique<WrongController>(std::move(parts_.controller), 0.999);
  const StepRecord& step = Run();
  EXPECT_EQ(runner_->result().failure, "");
  EXPECT_LE(Worst("inverse_dynamics_robot"), 1e-5);
  EXPECT_GT(runner_->result().tracking.position_max(), 1e-6);
  // What the law demanded is not what happened.
  EXPECT_GT((step.response.xi_dot - step.command.demand.xi_dot).norm(), 1e-3);
}

TEST_F(LoopPartsTest, TheRecordHasWhatTheLawDemandedAndWhatCameOfIt) {
  const StepRecord& step = Run();
  EXPECT_EQ(step.step, 100);
  EXPECT_NEAR(step.time, 0.099, 1e-12);
  const double scale = step.findings.f_c.norm();
  ASSERT_GT(scale, 1.0);
  // The engine's contacts are soft: measured 3e-7.
  EXPECT_LT((step.findings.f_c - step.command.demand.f_c).norm(), 1e-5 * scale);
  EXPECT_LT((step.response.xi_dot - step.command.demand.xi_dot).norm(), 1e-3);
  EXPECT_LT((step.response.V_Bo_dot - step.command.demand.V_Bo_dot).norm(), 1e-4);
  EXPECT_LT((step.response.motor_torques - step.drive.tau).norm(), 1e-12 * step.drive.tau.norm());
  EXPECT_EQ(step.drive.tau, step.command.tau);
  EXPECT_EQ(step.measured.state.q, step.reading.state.q);
}

}  // namespace
}  // namespace dexcheck::testing::loop_parts_test
