#pragma once

// Which part of a plant that is not ideal costs the accuracy?

#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "controller/control/actuation.h"
#include "controller/control/constrained_dynamics.h"
#include "controller/control/controller.h"
#include "controller/control/grasp_model.h"
#include "controller/control/trajectory.h"
#include "harness/checks/step_record.h"
#include "harness/plant/disturbances.h"
#include "harness/plant/motor_drive.h"
#include "harness/plant/sensing.h"
#include "harness/scenario/scenario.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// One thing in which a scenario's plant is not ideal.
struct ErrorSource {
  std::string name;  ///< Its key: "sensing.joint_counts", "disturbance.0".
  /// Takes it out. The random numbers of the others stay as they are.
  std::function<void(Imperfections*)> drop;
  bool acts_at_rest = true;  ///< Whether its error is there before t = 0: all but pushes and noise.
};

/// Those that do something. `actuation.saturate` is no source: it says what becomes of a limit.
std::vector<ErrorSource> ListErrorSources(const Imperfections& imperfections);

/// Size of an error over a run: of the object's position, m; of a motion of joints at each step the joint
/// that is farthest from its place, rad or m.
struct ErrorSize {
  double rms = 0.0;
  double max = 0.0;
};

/// One source.
struct BudgetEntry {
  std::string name;
  ErrorSize alone;      ///< With this source only.
  ErrorSize without;    ///< With all others.
  ErrorSize predicted;  ///< To first order, see ErrorPrediction; not a number of a law that is not known.
  /// RMS of what it adds in company less what it adds alone, relative to the RMS of all.
  double interaction = 0.0;
  std::string failure;  ///< Why one of its two runs ended early; empty when none did.

  /// A source interacts where it makes another error in company than alone, by more than kInteracts.
  [[nodiscard]] bool interacts() const { return interaction > kInteracts; }
  static constexpr double kInteracts = 0.1;
};

/// All sources of a scenario. Errors are judged from `expect.from` on.
struct ErrorBudget {
  std::string scenario;
  bool of_joints = false;  ///< The errors are those of a motion of joints.
  std::string unit = "m";  ///< Or "rad", "rad or m".
  ErrorSize ideal;         ///< With no source.
  ErrorSize all;           ///< With every source.
  ErrorSize sum;           ///< Errors of the runs with one source each, added as functions of time.
  ErrorSize predicted;     ///< Likewise of the predictions.
  std::string failure;     ///< Why the ideal run or that with all ended early; empty when none did.
  std::vector<BudgetEntry> entries;

  /// Whether every run came to its end.
  [[nodiscard]] bool is_complete() const;
};

/// Runs the scenario 2 n + 2 times for its n sources, unchecked, `jobs` runs at a time.
/// @param progress called often with the number of runs done and to do; false stops.
/// @throws InputError as Setup; when the scenario is a task or its plant is ideal.
ErrorBudget CalcErrorBudget(const Scenario& scenario, const std::filesystem::path& robot,
                            const std::filesystem::path& mjcf, int jobs,
                            const std::function<bool(long done, long total)>& progress);

nlohmann::ordered_json ToJson(const ErrorBudget& budget);

/// Errors by step: of the object's position (3), m, or of joints (n), rad or m.
struct Errors {
  std::vector<double> values;  ///< One step behind the other.
  size_t size = 3;             ///< Numbers of a step.
  void Append(const VectorXd& error) {
    size = static_cast<size_t>(error.size());
    values.insert(values.end(), error.begin(), error.end());
  }
  [[nodiscard]] size_t CountSteps() const { return values.size() / size; }
  [[nodiscard]] Eigen::Map<const VectorXd> At(size_t step) const {
    return {values.data() + step * size, static_cast<Eigen::Index>(size)};
  }
};

/// Predicts to first order what a plant that is not ideal makes of the tracking error: along the run of an
/// ideal one it computes at each step what would be measured, what the law would send then, what the motors
/// would deliver, and how the rigid system (19), (46), (48) with the plant's own masses and pushes would
/// accelerate. That acceleration less the ideal one, d, drives the error. Of the object's position, with the
/// gains of (57),
///
///   e_ddot + K_v e_dot + K_p e = -d,   e = X_d - X_o
///
/// and in the same way of the joints that follow a motion of their own, e = q_d - q, by computed torque. The
/// other laws of joints leave e_ddot = -d - M^-1 (K e + D e_dot).
class ErrorPrediction {
 public:
  /// @param setup of the scenario with its imperfections; outlives this.
  /// @param acts_at_rest whether the run begins with the error that the first d has in the end.
  ErrorPrediction(const Setup& setup, bool acts_at_rest);

  /// Acceleration at a step of the ideal run: of the object's origin, world (3), m/s^2, or of the joints (n).
  /// Once at each step.
  const VectorXd& CalcAcceleration(const StepRecord& ideal);
  /// One step of the error. @param d as CalcAcceleration.
  void Step(const VectorXd& d);
  /// The error at each step, less that of the ideal run.
  [[nodiscard]] const Errors& errors() const { return errors_; }

 private:
  Sensing sensing_;
  MotorDrive drive_;
  Disturbances disturbances_;
  std::unique_ptr<Trajectory> trajectory_;
  std::unique_ptr<Controller> controller_;
  GraspModel model_;
  ConstrainedDynamics dynamics_;
  ActuationMap actuation_;
  const JointMotion* joint_motion_;  // null of an object
  bool is_decoupled_ = true;         // the error's dynamics have gains of their own
  Reading measured_;
  Command command_;
  VectorXd tau_, force_;      // n
  Eigen::ArrayXd K_p_, K_v_;  // or K, D
  double time_step_;
  bool acts_at_rest_;
  bool has_begun_ = false;
  VectorXd acceleration_, e_, e_dot_, e_ddot_;
  Errors errors_;
};

}  // namespace dexcheck
