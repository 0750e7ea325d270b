#pragma once

// The engine's simulation of robot and object, stepped by torques.

#include <functional>
#include <vector>

#include "controller/common/types.h"
#include "harness/engine/adapter.h"
#include "harness/engine/engine.h"
#include "harness/plant/plant.h"

namespace dexcheck {

/// State of the engine that determines everything after it.
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
  /// @param implicit_damping integrates as the MJCF states, with joint damping as in the engine's Euler,
  /// whose changes of velocities are not dt qacc; otherwise by Euler with explicit forces, as in (48).
  /// @throws InputError when a joint or wheel has no motor or several.
  EngineSimulation(const Adapter& adapter, bool implicit_damping);

  [[nodiscard]] const Adapter& adapter() const { return *adapter_; }
  [[nodiscard]] const mjModel& model() const { return *model_; }
  [[nodiscard]] const mjData& data() const { return *data_; }
  [[nodiscard]] mjData& data() { return *data_; }
  [[nodiscard]] double time() const { return data_->time; }
  [[nodiscard]] double time_step() const { return model_->opt.timestep; }

  void BeginStep();
  /// Sets tau' (n), N m: of the right and left wheel, then of the joints.
  void SetTorques(const Eigen::Ref<const VectorXd>& tau);
  /// Sets forces and torques on bodies; replaces the earlier ones.
  void Push(std::span<const Wrench> wrenches);
  /// The torques that wheels and joints received in the last step, as tau' (n), N m.
  void ReadMotorTorques(VectorXd* tau) const;
  /// Lists the motors by entry of tau'.
  [[nodiscard]] std::vector<Motor> ListMotors() const;
  /// @throws DivergenceError when the engine warned or the state is not finite.
  void EndStep();

  /// Changes this simulation's own model, and the quantities that the engine derives from it.
  void Change(const std::function<void(mjModel*)>& change);
  /// Whether Change was called.
  [[nodiscard]] bool is_changed() const { return is_changed_; }

  [[nodiscard]] EngineState GetState() const;
  void SetState(const EngineState& state);

 private:
  void CheckHealth(double expected_time) const;

  const Adapter* adapter_;
  MjModelPtr model_;  // the adapter's, but for the damping
  MjDataPtr data_;
  bool is_pushed_ = false, is_changed_ = false;
  VectorXd damping_;         // nv, N m s/rad; not integrated implicitly
  std::vector<int> motors_;  // by entry of tau'; -1 for those of a floating base
  std::vector<int> dofs_;    // by entry of tau', as motors_
};

/// Computes what the engine derives from masses and places; bodies stay joined where they are.
void DeriveConstants(mjModel* model);

/// Returns one of the engine's contacts. @param first whether the body whose slip it is stands first in it.
BodyContact ReadContact(const mjModel& m, const mjData& d, int contact, bool first);
/// Returns the contact of `body` with `other`, once the step's forces are known.
BodyContact ReadBodyContact(const mjModel& m, const mjData& d, int body, int other);

}  // namespace dexcheck
