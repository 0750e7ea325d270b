#pragma once

// Plants that are wrong on purpose: what stands between controller and engine, or acts on the engine's
// bodies, without the judge being told. Do the checks find it, and measure what it is?

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "harness/checks/failure_cause.h"
#include "harness/plant/engine_plant.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// Changes what the motors give: tau' (n) at time t, s.
using MotorFault = std::function<void(double t, VectorXd* tau)>;
/// Changes what the controller is told at time t, s.
using SensorFault = std::function<void(double t, MeasuredState* told)>;

/// One fault. Its members are called for each run anew, so that none remembers another's.
struct PlantFault {
  std::string name;            ///< "motor r_elbow: gain 0.99".
  std::string kind;            ///< "motor": what a table sums up by.
  Cause cause = Cause::kNone;  ///< That the verdict should have.
  std::string part = {};       ///< What the evidence should name; empty for nothing.
  /// Whether it is there before the robot settles: a step of the contacts' geometry would throw it.
  bool from_start = false;
  std::function<void(const Setup&, mjModel*)> engine = {};             ///< Changes bodies and constraints.
  std::function<void(const mjModel&, double t, mjData*)> forces = {};  ///< Sets xfrc_applied.
  std::function<MotorFault(const Setup&)> motors = {};
  std::function<SensorFault(const Setup&)> sensors = {};
};

/// Faults of motors, of joints, links and object, of floor, wheels and contacts, of sensors and of the
/// solver: those that there can be of the scenario's robot, at joints and links along its arm and fingers.
std::vector<PlantFault> ListPlantFaults(const Setup& setup);

/// What of a wheel, 0 the right one or 1, touches the floor gets a radius that is larger by `by`, m.
void ScaleWheel(const Setup& setup, mjModel* m, size_t wheel, double by);
/// Wheels that are farther apart by `by`, m.
void MoveWheels(const Setup& setup, mjModel* m, double by);

/// The engine's simulation with a fault.
class FaultyPlant final : public Plant {
 public:
  FaultyPlant(const Setup& setup, std::unique_ptr<EnginePlant> plant, const PlantFault& fault);

  [[nodiscard]] double time_step() const override { return plant_->time_step(); }
  [[nodiscard]] std::span<const Motor> motors() const override { return plant_->motors(); }
  void BeginStep() override { plant_->BeginStep(); }
  void Read(PlantReading* reading) override { plant_->Read(reading); }
  void EndStep(const Eigen::Ref<const VectorXd>& tau) override;
  void Read(PlantResponse* response) override { plant_->Read(response); }
  void Place(const Eigen::Ref<const VectorXd>& q, const Pose& X_Bo) override { plant_->Place(q, X_Bo); }
  void AddVelocity(const MeasuredState& state, const Vector3d& v) override { plant_->AddVelocity(state, v); }
  void Translate(const Vector3d& way) override { plant_->Translate(way); }

 private:
  std::unique_ptr<EnginePlant> plant_;
  MotorFault motors_;
  std::function<void(const mjModel&, double, mjData*)> forces_;
  double time_ = 0.0;
  VectorXd tau_;
};

}  // namespace dexcheck
