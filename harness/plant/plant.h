#pragma once

// The ground truth: the engine's simulation of robot and object, stepped by torques.

#include <span>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/types.h"
#include "harness/adapter/adapter.h"
#include "harness/engine/engine.h"

namespace dexcheck {

/// The simulation left the region where its numbers mean anything.
class DivergenceError : public Error {
 public:
  using Error::Error;
};

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
class Plant {
 public:
  /// @param implicit_damping integrate joint damping as the engine's Euler does, which changes velocities by
  /// other than dt qacc; otherwise it acts as an explicit force, as in (48).
  /// @throws InputError when a joint or wheel has no motor or several.
  Plant(const Adapter& adapter, bool implicit_damping);

  [[nodiscard]] const Adapter& adapter() const { return *adapter_; }
  [[nodiscard]] const mjModel& model() const { return *model_; }
  [[nodiscard]] const mjData& data() const { return *data_; }
  [[nodiscard]] mjData& data() { return *data_; }
  [[nodiscard]] double time() const { return data_->time; }
  /// Positions at the beginning of the step (nq).
  [[nodiscard]] const VectorXd& step_qpos() const { return step_qpos_; }
  [[nodiscard]] double time_step() const { return model_->opt.timestep; }

  void BeginStep();
  /// tau' (n), N m: of the right and left wheel, then of the joints.
  void SetTorques(const Eigen::Ref<const VectorXd>& tau);
  /// Largest |tau'| / limit over the motors, and the motor; more than 1 is cut off by the engine.
  [[nodiscard]] double CalcEffort(const Eigen::Ref<const VectorXd>& tau, int* worst) const;
  /// Name of the joint of a motor by its entry of tau'.
  [[nodiscard]] std::string motor_name(int entry) const;
  /// Limit of |tau'| of a motor by its entry of tau', N m; infinity without.
  [[nodiscard]] double torque_limit(int entry) const { return limits_[static_cast<size_t>(entry)]; }
  /// @throws DivergenceError when the engine warned or the state is not finite.
  void EndStep();

  [[nodiscard]] EngineState GetState() const;
  void SetState(const EngineState& state);

 private:
  void CheckHealth(double expected_time) const;

  const Adapter* adapter_;
  MjModelPtr model_;  // the adapter's, but for the damping
  MjDataPtr data_;
  VectorXd damping_;  // nv, N m s/rad; what is not integrated implicitly
  VectorXd step_qpos_;
  std::vector<int> motors_;     // by entry of tau'
  std::vector<double> limits_;  // likewise
};

}  // namespace dexcheck
