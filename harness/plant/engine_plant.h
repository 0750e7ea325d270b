#pragma once

#include <span>
#include <utility>
#include <vector>

#include "harness/plant/engine_simulation.h"
#include "harness/plant/observer.h"
#include "harness/plant/plant.h"

namespace dexcheck {

/// The engine's simulation as plant. Nothing allocates in a step, once the results have their sizes.
class EnginePlant final : public Plant {
 public:
  /// @param fingertips frames of the grasp. @param surface of the object; outlives this, as does the adapter.
  /// @throws as EngineSimulation and Observer.
  EnginePlant(const Adapter& adapter, std::span<const int> fingertips, const Surface& surface,
              bool implicit_damping);

  /// See Observer.
  void SetBonds(std::span<const ContactCoordinates> kappa, std::span<const int> constraints) {
    observer_.SetBonds(kappa, constraints);
  }

  /// See Observer.
  void SetFeet(std::span<const int> frames) { observer_.SetFeet(frames); }

  /// Watches geoms that should not touch and that push each other: their forces are read.
  void WatchCollisions(std::span<const std::pair<int, int>> geoms);

  [[nodiscard]] double time_step() const override { return simulation_.time_step(); }
  [[nodiscard]] std::span<const Motor> motors() const override { return motors_; }

  void BeginStep() override { simulation_.BeginStep(); }
  void Read(PlantReading* reading) override;
  void Push(std::span<const Wrench> wrenches) override { simulation_.Push(wrenches); }
  void EndStep(const Eigen::Ref<const VectorXd>& tau) override;
  void Read(PlantResponse* response) override;

  /// Simulation, for effects in the engine that are no part of the scenario.
  [[nodiscard]] EngineSimulation& simulation() { return simulation_; }

  void Place(const Eigen::Ref<const VectorXd>& q, const Pose& X_Bo) override;
  void AddVelocity(const MeasuredState& state, const Vector3d& v) override;
  void Translate(const Vector3d& way) override;

 private:
  [[nodiscard]] Collision FindCollision() const;

  const Adapter* adapter_;
  EngineSimulation simulation_;
  Observer observer_;
  std::vector<Motor> motors_;
  std::vector<std::pair<int, int>> colliding_;  // the smaller number first, sorted
  double support_force_ = 0.0;                  // of the last response
};

}  // namespace dexcheck
