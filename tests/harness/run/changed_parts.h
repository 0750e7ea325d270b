#pragma once

// Parts of a loop that are not what they should be.

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "harness/run/runner.h"

namespace dexcheck::testing {

/// A plant that is given other torques than its own, and answers otherwise.
class ChangedPlant final : public Plant {
 public:
  /// @param gain of the torques. @param change of the response, and of the reading; none for nothing.
  ChangedPlant(std::unique_ptr<Plant> plant, double gain,
               std::function<void(PlantResponse* response)> change = {},
               std::function<void(PlantReading* reading)> change_reading = {})
      : plant_(std::move(plant)),
        gain_(gain),
        change_(std::move(change)),
        change_reading_(std::move(change_reading)) {}
  double time_step() const override { return plant_->time_step(); }
  std::span<const Motor> motors() const override { return plant_->motors(); }
  void BeginStep() override { plant_->BeginStep(); }
  void Read(PlantReading* reading) override {
    plant_->Read(reading);
    if (change_reading_) change_reading_(reading);
  }
  void EndStep(const Eigen::Ref<const VectorXd>& tau) override { plant_->EndStep(gain_ * tau); }
  void Read(PlantResponse* response) override {
    plant_->Read(response);
    if (change_) change_(response);
  }
  void Place(const Eigen::Ref<const VectorXd>& q, const Pose& X_Bo) override { plant_->Place(q, X_Bo); }
  void AddVelocity(const MeasuredState& state, const Vector3d& v) override { plant_->AddVelocity(state, v); }
  void Translate(const Vector3d& way) override { plant_->Translate(way); }

 private:
  std::unique_ptr<Plant> plant_;
  double gain_;
  std::function<void(PlantResponse* response)> change_;
  std::function<void(PlantReading* reading)> change_reading_;
};

/// A controller whose command is changed after each step.
class ChangedController final : public Controller {
 public:
  using Change = std::function<void(const GraspModel& model, Command* command)>;
  ChangedController(std::unique_ptr<Controller> law, Change change)
      : law_(std::move(law)), change_(std::move(change)) {}
  void Follow(const Trajectory& motion) override { law_->Follow(motion); }
  void Begin(double t, const Reading& reading) override { law_->Begin(t, reading); }
  void Step(const Reading& reading, double t, Command* command) override {
    law_->Step(reading, t, command);
    change_(law_->model(), command);
  }
  const GraspModel& model() const override { return law_->model(); }

 private:
  std::unique_ptr<Controller> law_;
  Change change_;
};

/// Runs a scenario with parts of its own. @returns the runner, finished.
inline std::unique_ptr<Runner> RunParts(const Setup& setup, LoopParts parts) {
  auto runner = std::make_unique<Runner>(setup, /*check=*/true, std::move(parts));
  runner->Run([](const StepRecord&) {}, [] { return false; });
  return runner;
}

}  // namespace dexcheck::testing
