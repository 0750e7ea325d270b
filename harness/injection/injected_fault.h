#pragma once

// Faults that are made in a run on purpose: in what stands between controller and engine, in what acts on the
// engine's bodies, in the controller and its model, unknown to the judge. Do the checks find them,
// and are they named? A law's faults are entries of the table that names them; of all others this folder does
// not know the signatures that they are recognised by.

#include <functional>
#include <limits>
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

/// Whether the fault is there.
using IsOn = std::function<bool()>;
/// A controller in the place of the right one, which it may have.
using ControllerFault =
    std::function<std::unique_ptr<Controller>(const Setup&, std::unique_ptr<Controller> right, const IsOn&)>;

/// One fault, or several at once. Its members are called for each run anew, so that none remembers another's.
struct InjectedFault {
  std::string name;            ///< "motor r_elbow: gain 0.99".
  std::string kind;            ///< "motor": what a table sums up by.
  Cause cause = Cause::kNone;  ///< That the verdict should have.
  std::string part = {};       ///< What evidence or failed checks should name; empty for nothing.
  /// How it should be named; `error` is by how much it changes its value. Empty for what has no size.
  std::vector<Fault> truth = {};
  /// It is there before the robot settles: a step of the contacts' geometry would throw it.
  bool from_start = false;
  /// It shows only where feedback has something to correct.
  bool needs_error = false;
  std::function<void(const Setup&, mjModel*)> engine = {};             ///< Changes bodies and constraints.
  std::function<void(const mjModel&, double t, mjData*)> forces = {};  ///< Adds to xfrc_applied.
  std::function<MotorFault(const Setup&)> motors = {};
  std::function<SensorFault(const Setup&)> sensors = {};
  ControllerFault controller = {};                          ///< In the place of the right one.
  std::function<RobotModel(const RobotModel&)> model = {};  ///< That the controller goes by.
};

/// Both at once. At most one of them has a controller, and one a model.
InjectedFault Join(const InjectedFault& first, const InjectedFault& second);

/// Time of a run, s, as its controller knows it.
struct RunClock {
  bool has_begun = false;  ///< Whether all has come to rest.
  double time = 0.0;       ///< Of the last step.
  /// How long a fault is there at time t that begins at `begin`, s; endless time before it where the run has
  /// not begun.
  [[nodiscard]] double Since(double begin, double t) const {
    return has_begun ? t - begin : -std::numeric_limits<double>::infinity();
  }
};

/// The engine's simulation with a fault that is there from a time of the run on.
class FaultyPlant final : public Plant {
 public:
  /// @param clock of the run. @param begin of the fault, s; one that is there from the start changes bodies
  /// at once.
  FaultyPlant(const Setup& setup, std::unique_ptr<EnginePlant> plant, const InjectedFault& fault,
              std::shared_ptr<const RunClock> clock, double begin);

  [[nodiscard]] double time_step() const override { return plant_->time_step(); }
  [[nodiscard]] std::span<const Motor> motors() const override { return plant_->motors(); }
  void BeginStep() override;
  void Read(PlantReading* reading) override { plant_->Read(reading); }
  void Push(std::span<const Wrench> wrenches) override { plant_->Push(wrenches); }
  void EndStep(const Eigen::Ref<const VectorXd>& tau) override;
  void Read(PlantResponse* response) override { plant_->Read(response); }
  void Place(const Eigen::Ref<const VectorXd>& q, const Pose& X_Bo) override { plant_->Place(q, X_Bo); }
  void AddVelocity(const MeasuredState& state, const Vector3d& v) override { plant_->AddVelocity(state, v); }
  void Translate(const Vector3d& way) override { plant_->Translate(way); }

 private:
  std::unique_ptr<EnginePlant> plant_;
  std::shared_ptr<const RunClock> clock_;
  double begin_;
  MotorFault motors_;
  std::function<void(const mjModel&, double, mjData*)> forces_;
  std::function<void(mjModel*)> change_;  // that is yet to be made
  VectorXd tau_;
};

/// A controller that reports the time.
class ClockedController final : public Controller {
 public:
  ClockedController(std::unique_ptr<Controller> controller, std::shared_ptr<RunClock> clock)
      : controller_(std::move(controller)), clock_(std::move(clock)) {}

  void Follow(const Trajectory& motion) override { controller_->Follow(motion); }
  void Begin(double t, const Reading& reading) override {
    controller_->Begin(t, reading);
    clock_->has_begun = true;
  }
  void Step(const Reading& reading, double t, Command* command) override {
    clock_->time = t;
    controller_->Step(reading, t, command);
  }
  [[nodiscard]] const GraspModel& model() const override { return controller_->model(); }

 private:
  std::unique_ptr<Controller> controller_;
  std::shared_ptr<RunClock> clock_;
};

}  // namespace dexcheck
