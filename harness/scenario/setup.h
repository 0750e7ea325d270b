#pragma once

// A scenario made real: both models loaded, the grasp solved, the simulation settled.

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "controller/control/trajectory.h"
#include "controller/control/trajectory_controller.h"
#include "controller/model/robot_model.h"
#include "harness/plant/plant.h"
#include "harness/scenario/robot_pair.h"
#include "harness/scenario/scenario.h"
#include "harness/scenario/start_state.h"

namespace dexcheck {

/// Everything of a run that does not change while it runs. Owns both models.
class Setup {
 public:
  /// @param robot parameter file. @param mjcf scene.
  /// @throws InputError when a file, a name or a value cannot be used.
  Setup(const Scenario& scenario, const std::filesystem::path& robot, const std::filesystem::path& mjcf);
  /// A setup with the scene compiled already, which is most of the work. @param mjcf names it in messages.
  Setup(const Scenario& scenario, const std::filesystem::path& robot, const std::filesystem::path& mjcf,
        MjModelPtr engine);
  /// A setup with the robot read already, too. Overrides of its parameters are not applied again.
  Setup(const Scenario& scenario, RobotModel model, const std::filesystem::path& mjcf, MjModelPtr engine);

  /// The scenario as it was read, but for what its seed varies and its task plans.
  [[nodiscard]] const Scenario& scenario() const { return scenario_; }
  [[nodiscard]] const RobotPair& robots() const { return robots_; }
  [[nodiscard]] const Hold& hold() const { return hold_; }
  [[nodiscard]] const StartState& start() const { return start_; }
  /// The motion that joints of a robot that holds nothing should follow; null for other tasks.
  [[nodiscard]] const JointPlan* joints() const { return joints_ ? &*joints_ : nullptr; }
  /// Frames that a robot with a floating base stands on; none for others.
  [[nodiscard]] std::span<const int> feet() const {
    return joints_ && joints_->gains.stance ? std::span<const int>(joints_->gains.stance->feet)
                                            : std::span<const int>();
  }
  /// Surface of the object; any of a robot that holds nothing.
  [[nodiscard]] const Surface& surface() const { return *surface_; }

  [[nodiscard]] const RobotModel& model() const { return robots_.model; }
  [[nodiscard]] const mjModel& engine() const { return *robots_.engine; }
  [[nodiscard]] const Adapter& adapter() const { return *robots_.adapter; }
  [[nodiscard]] const ConstantChecks& constants() const { return robots_.constants; }
  [[nodiscard]] const std::vector<int>& fingertips() const { return hold_.fingertips; }
  /// Whether there is an object; otherwise object() stands for it where terms of one are evaluated.
  [[nodiscard]] bool has_object() const { return model().object().has_value(); }
  [[nodiscard]] const ObjectModel& object() const;

  /// The engine's robot: model(), but for a mismatch that the scenario declares.
  [[nodiscard]] const RobotModel& declared_model() const {
    return robots_.declared ? robots_.declared->plant : model();
  }
  [[nodiscard]] const ObjectModel& declared_object() const;
  /// Maps declared_model() to engine().
  [[nodiscard]] const Adapter& plant_adapter() const {
    return robots_.declared ? robots_.declared->plant_adapter : adapter();
  }
  /// Compares model() with an engine without the mismatch.
  [[nodiscard]] const Adapter& controller_adapter() const {
    return robots_.declared ? robots_.declared->controller_adapter : adapter();
  }

  /// The object's desired motion from where it starts; null for tasks without one.
  [[nodiscard]] std::unique_ptr<Trajectory> MakeTrajectory() const;
  /// For the parts of a loop.
  [[nodiscard]] PartContext MakePartContext() const;
  /// A controller's model; of a robot that holds nothing, without X_o.
  [[nodiscard]] GraspModelOptions MakeModelOptions() const;
  /// When its controller is evaluated.
  [[nodiscard]] Sampling MakeSampling() const;
  /// Options of the law, with the posture and the angles' branch of the start.
  [[nodiscard]] GraspControllerOptions MakeControllerOptions() const;

 private:
  /// Stiffness and damping of a law that has them: the scenario's, or those that follow from its gains.
  [[nodiscard]] ObjectStiffness FindStiffness(const GraspControllerOptions& options) const;

  Scenario scenario_;
  RobotPair robots_;
  std::unique_ptr<Surface> surface_;
  Hold hold_;
  StartState start_;
  std::optional<JointPlan> joints_;
};

}  // namespace dexcheck
