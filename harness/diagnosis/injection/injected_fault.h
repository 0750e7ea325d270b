#pragma once

// Faults that are made in a run on purpose: in what stands between controller and engine, in what acts on the
// engine's bodies, in the controller and its model, without the judge being told. Do the checks find them,
// and are they named? Nothing in this folder knows the signatures that they are recognised by.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "harness/checks/failure_cause.h"
#include "harness/diagnosis/causes.h"
#include "harness/plant/engine_plant.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// Changes the motors' torques: tau' (n) at time t, s.
using MotorFault = std::function<void(double t, VectorXd* tau)>;
/// Changes the measured state at time t, s.
using SensorFault = std::function<void(double t, MeasuredState* measured)>;

/// One fault, or several at once. Its members are called for each run anew, so that none remembers another's.
struct InjectedFault {
  std::string name;            ///< "motor r_elbow: gain 0.99".
  std::string kind;            ///< "motor": what a table sums up by.
  Cause cause = Cause::kNone;  ///< That the verdict should have.
  std::string part = {};       ///< What evidence or failed checks should name; empty for nothing.
  /// How it should be named; `error` is by how much it changes its value. Empty for what has no size.
  std::vector<Fault> truth = {};
  /// Whether it is there before the robot settles: a step of the contacts' geometry would throw it.
  bool from_start = false;
  /// Whether it shows only where feedback has something to correct.
  bool needs_error = false;
  std::function<void(const Setup&, mjModel*)> engine = {};             ///< Changes bodies and constraints.
  std::function<void(const mjModel&, double t, mjData*)> forces = {};  ///< Adds to xfrc_applied.
  std::function<MotorFault(const Setup&)> motors = {};
  std::function<SensorFault(const Setup&)> sensors = {};
  /// In the place of the right one, or around it.
  std::function<std::unique_ptr<Controller>(const Setup&, std::unique_ptr<Controller> right)> controller = {};
  std::function<RobotModel(const RobotModel&)> model = {};  ///< That the controller goes by.
};

/// Both at once. At most one of them has a controller, and one a model.
InjectedFault Join(const InjectedFault& first, const InjectedFault& second);

/// The engine's simulation with a fault.
class FaultyPlant final : public Plant {
 public:
  FaultyPlant(const Setup& setup, std::unique_ptr<EnginePlant> plant, const InjectedFault& fault);

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
