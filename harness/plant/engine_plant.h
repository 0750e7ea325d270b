#pragma once

#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "controller/common/types.h"
#include "harness/engine/adapter.h"
#include "harness/engine/engine.h"
#include "harness/plant/observer.h"
#include "harness/plant/plant.h"

namespace dexcheck {

// The engine's simulation of robot and object, stepped by torques.

/// Engine state that determines everything after it.
struct EngineState {
  VectorXd qpos, qvel, act, qacc_warmstart;
  double time = 0.0;
};

/// One simulation. A step has two halves, so that a controller can be put between them:
///
///   BeginStep   positions, velocities, contacts at time()
///   (read the state, set torques)
///   EndStep     accelerations and forces for these torques, then the state at time() + dt
///
/// After EndStep, data() still has accelerations, contacts and forces of the step, at the state before it.
class EngineSimulation {
 public:
  /// @param implicit_damping integrate as the MJCF says, and joint damping as the engine's Euler does, which
  /// changes velocities by other than dt qacc; otherwise by Euler with explicit forces, as in (48).
  /// @throws InputError when a joint or wheel has no motor or several.
  EngineSimulation(const Adapter& adapter, bool implicit_damping);

  [[nodiscard]] const Adapter& adapter() const { return *adapter_; }
  [[nodiscard]] const mjModel& model() const { return *model_; }
  [[nodiscard]] const mjData& data() const { return *data_; }
  [[nodiscard]] mjData& data() { return *data_; }
  [[nodiscard]] double time() const { return data_->time; }
  [[nodiscard]] double time_step() const { return model_->opt.timestep; }

  void BeginStep();
  /// tau' (n), N m: of the right and left wheel, then of the joints.
  void SetTorques(const Eigen::Ref<const VectorXd>& tau);
  /// Forces and torques on bodies, instead of those before.
  void Push(std::span<const Wrench> wrenches);
  /// The torques that wheels and joints received in the last step, as tau' (n), N m.
  void ReadMotorTorques(VectorXd* tau) const;
  /// By entry of tau'.
  [[nodiscard]] std::vector<Motor> ListMotors() const;
  /// @throws DivergenceError when the engine warned or the state is not finite.
  void EndStep();

  /// Changes the model that is simulated, which is this simulation's own, and what the engine derives of it.
  void Change(const std::function<void(mjModel*)>& change);

  [[nodiscard]] EngineState GetState() const;
  void SetState(const EngineState& state);

 private:
  void CheckHealth(double expected_time) const;

  const Adapter* adapter_;
  MjModelPtr model_;  // the adapter's, but for the damping
  MjDataPtr data_;
  bool is_pushed_ = false;
  VectorXd damping_;         // nv, N m s/rad; what is not integrated implicitly
  std::vector<int> motors_;  // by entry of tau'
  std::vector<int> dofs_;    // likewise
};

/// The engine's simulation as plant. Nothing allocates in a step, once the values that are read into have
/// their sizes.
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

  /// Geoms that should not touch, and that do push: what they push with is read.
  void WatchCollisions(std::span<const std::pair<int, int>> geoms);

  [[nodiscard]] double time_step() const override { return simulation_.time_step(); }
  [[nodiscard]] std::span<const Motor> motors() const override { return motors_; }

  void BeginStep() override { simulation_.BeginStep(); }
  void Read(PlantReading* reading) override;
  void Push(std::span<const Wrench> wrenches) override { simulation_.Push(wrenches); }
  void EndStep(const Eigen::Ref<const VectorXd>& tau) override;
  void Read(PlantResponse* response) override;

  /// For what acts in the engine and is no part of the scenario.
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
