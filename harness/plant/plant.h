#pragma once

// The simulated plant: robot and object, driven by torques.

#include <cstdint>
#include <span>
#include <string>

#include "controller/common/errors.h"
#include "controller/common/types.h"
#include "controller/model/robot_model.h"
#include "harness/plant/plant_reading.h"

namespace dexcheck {

/// A force and a torque that act on one body, in world axes.
struct Wrench {
  static constexpr int kObject = -2;
  int body = kObject;                  ///< Index of the joint that moves the link; -1 is the base.
  Vector3d point = Vector3d::Zero();   ///< Where the force acts, m.
  Vector3d force = Vector3d::Zero();   ///< N.
  Vector3d torque = Vector3d::Zero();  ///< N m.
};

/// The simulation left the region where its numbers mean anything.
class DivergenceError : public Error {
 public:
  using Error::Error;
};

/// The simulated robot failed: fell, or reached a motor's limit.
class RunFailure : public Error {
 public:
  using Error::Error;
};

/// The motor of one entry of tau'.
struct Motor {
  std::string name;    ///< Of its joint.
  double limit = 0.0;  ///< Of |tau'|, N m; infinity without.
};

/// One plant. A step has two halves, so that a controller can be put between them:
///
///   BeginStep              positions, velocities, contacts
///   Read(PlantReading*)
///   EndStep(tau')          accelerations and forces for these torques, then the state a time step later
///   Read(PlantResponse*)
class Plant {
 public:
  virtual ~Plant() = default;
  Plant(const Plant&) = delete;
  Plant& operator=(const Plant&) = delete;

  /// s.
  [[nodiscard]] virtual double time_step() const = 0;
  /// By entry of tau'.
  [[nodiscard]] virtual std::span<const Motor> motors() const = 0;

  virtual void BeginStep() = 0;
  /// What the plant is; between BeginStep and EndStep.
  virtual void Read(PlantReading* reading) = 0;
  /// Pushes that act besides during the step whose torques come next.
  /// @throws InputError when there are any and this kind of plant takes none.
  virtual void Push(std::span<const Wrench> wrenches) {
    if (!wrenches.empty()) throw InputError("disturbance: this plant takes no pushes");
  }
  /// @param tau tau' (n), N m: of the right and left wheel, then of the joints.
  /// @throws DivergenceError when there is no state afterwards.
  virtual void EndStep(const Eigen::Ref<const VectorXd>& tau) = 0;
  /// How it responded; after EndStep, of a step whose reading was read.
  virtual void Read(PlantResponse* response) = 0;

  // Between steps.

  /// Robot and object at rest at q' and X_Bo.
  virtual void Place(const Eigen::Ref<const VectorXd>& q, const Pose& X_Bo) = 0;
  /// Adds v (m/s, world) to the velocity of everything: the platform drives straight ahead at it, wheels
  /// rolling, and what it carries goes along. @param state last read.
  virtual void AddVelocity(const MeasuredState& state, const Vector3d& v) = 0;
  /// Moves robot and object by `way` (m, world, horizontal).
  virtual void Translate(const Vector3d& way) = 0;

 protected:
  Plant() = default;
};

/// What every part of a loop is made with that must make the same numbers again.
struct PartContext {
  const RobotModel* model = nullptr;
  size_t num_contacts = 0;
  double time_step = 0.0;  ///< s.
  std::uint64_t seed = 0;
  std::string source;  ///< The scenario's file, for messages.
};

/// How the rigid plant steps.
enum class Integrator {
  kRungeKutta4,  ///< Four evaluations, fourth order for the torques given; velocities and positions of one
                 ///< time.
  /// One evaluation: new velocities, then positions by them. Velocities belong to the middle of the step
  /// before, as the engine's.
  kSemiImplicitEuler,
};

}  // namespace dexcheck
