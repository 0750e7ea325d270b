#pragma once

// A scenario made real: both models loaded, the grasp solved, the simulation settled.

#include <filesystem>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include "controller/control/grasp_controller.h"
#include "controller/control/joint_law.h"
#include "controller/control/trajectory.h"
#include "controller/grasp/contact_plan.h"
#include "controller/grasp/finger_placement.h"
#include "controller/model/robot_model.h"
#include "harness/descriptions/constant_checks.h"
#include "harness/engine/adapter.h"
#include "harness/engine/clearance.h"
#include "harness/plant/observer.h"
#include "harness/plant/part_context.h"
#include "harness/plant/plant.h"
#include "harness/scenario/scenario.h"

namespace dexcheck {

/// Everything of a run that does not change while it runs. Owns both models.
class Setup {
 public:
  /// @param robot parameter file. @param mjcf scene.
  /// @throws InputError when a file, a name or a value cannot be used.
  Setup(const Scenario& scenario, const std::filesystem::path& robot, const std::filesystem::path& mjcf);
  /// The same with the scene compiled already, which is most of the work. @param mjcf names it in messages.
  Setup(const Scenario& scenario, const std::filesystem::path& robot, const std::filesystem::path& mjcf,
        MjModelPtr engine);
  /// The same with the robot read already. Overrides of its parameters are not applied again.
  Setup(const Scenario& scenario, RobotModel model, const std::filesystem::path& mjcf, MjModelPtr engine);
  Setup(const Setup&) = delete;
  Setup& operator=(const Setup&) = delete;

  [[nodiscard]] const Scenario& scenario() const { return scenario_; }
  [[nodiscard]] const RobotModel& model() const { return model_; }
  /// The robot that a rigid plant moves, without what the controller alone is made to believe; null for the
  /// engine.
  [[nodiscard]] const RobotModel* plant_model() const { return plant_model_.get(); }
  /// With the scenario's changes.
  [[nodiscard]] const mjModel& engine() const { return *engine_; }
  [[nodiscard]] const Adapter& adapter() const { return *adapter_; }
  /// What the robot of engine() is: model(), but for a mismatch that the scenario asks for.
  [[nodiscard]] const RobotModel& known_model() const { return known_model_ ? *known_model_ : model_; }
  /// known_model() and engine(); model() and an engine without the mismatch.
  [[nodiscard]] const Adapter& plant_side() const { return plant_side_ ? *plant_side_ : *adapter_; }
  [[nodiscard]] const Adapter& controller_side() const {
    return controller_side_ ? *controller_side_ : *adapter_;
  }
  /// What the two descriptions disagree on before anything moves, the scenario's changes to the plant aside.
  [[nodiscard]] const ConstantChecks& constants() const { return constants_; }
  /// Whether there is one; otherwise object() stands for it where terms of one are evaluated.
  [[nodiscard]] bool has_object() const { return model_.object().has_value(); }
  [[nodiscard]] const ObjectModel& object() const { return model_.object() ? *model_.object() : no_object_; }
  /// That of known_model().
  [[nodiscard]] const ObjectModel& known_object() const {
    return has_object() ? *known_model().object() : no_object_;
  }
  [[nodiscard]] const Surface& surface() const { return *surface_; }
  /// Frames of the grasp; none for a robot that holds nothing.
  [[nodiscard]] const std::vector<int>& fingertips() const { return fingertips_; }
  /// Joints that lie on the chains to several fingertips of the grasp, from the base outward.
  [[nodiscard]] const std::vector<int>& arm_joints() const { return arm_joints_; }
  /// Joints that lie on no chain from the base to a fingertip of the grasp: they should stay still.
  [[nodiscard]] const std::vector<int>& idle_joints() const { return idle_joints_; }

  /// The hand that does the task; palm_frame -1 when the scenario is none.
  [[nodiscard]] const Hand& hand() const { return hand_; }

  /// The posture that holds the object, or that a task begins in, and where the object is; X_o on the branch
  /// with beta > 0.
  [[nodiscard]] const VectorXd& q_start() const { return q_start_; }
  [[nodiscard]] const Pose& X_Bo_start() const { return X_Bo_start_; }
  [[nodiscard]] const Vector6d& X_start() const { return X_start_; }

  /// Where fingertips and object are joined, in the bonded variant of the plant; none otherwise.
  [[nodiscard]] const std::vector<Bond>& bonds() const { return bonds_; }
  /// The engine's constraints that do it, by fingertip.
  [[nodiscard]] const std::vector<int>& bond_constraints() const { return bond_constraints_; }
  /// kappa at the start, by fingertip.
  [[nodiscard]] const std::vector<ContactCoordinates>& kappa_start() const { return kappa_start_; }

  /// For the parts of a loop.
  [[nodiscard]] PartContext MakePartContext() const;
  /// Options of the law, with the posture and the angles' branch of the start.
  [[nodiscard]] GraspControllerOptions MakeControllerOptions() const;
  /// The shapes of all bodies, and those pairs that are not meant to touch.
  [[nodiscard]] const Solids& solids() const { return solids_; }
  [[nodiscard]] const std::vector<WatchedPair>& watched_pairs() const { return watched_pairs_; }
  /// The motion of the joints that the scenario asks for, and its law's gains; null, and none.
  [[nodiscard]] const JointMotion* joint_motion() const { return joint_motion_ ? &*joint_motion_ : nullptr; }
  [[nodiscard]] const JointGains& joint_gains() const { return joint_gains_; }

 private:
  /// Lists the pairs, and lets them push when the scenario says so.
  void WatchSolids(const std::string& mjcf);
  void ApplyPlantOptions();
  void FindFingertips();
  void PlaceTask(std::mt19937_64* random);
  [[nodiscard]] VectorXd ReadPosture() const;
  [[nodiscard]] int FindGraspFrame() const;
  /// The grasp as given, or varied at random until the fingertips reach their contacts.
  void FindGrasp();
  /// Start, way points and gains of a scenario that moves joints.
  void PlaceJoints();
  void FindJointGains();
  /// Writes numbers by joint into q (joints alone). @throws InputError that names the key.
  void SetJoints(const JointNumbers& numbers, VectorXd* q) const;
  [[nodiscard]] int FindJointOf(const std::string& key, const std::string& name, bool in_degrees) const;
  void RequireInRange(const std::string& key, const VectorXd& q) const;
  /// Says which contact of the posture found lies past its fingertip's rim; empty for none.
  [[nodiscard]] std::string FindContactPastRim() const;
  void VaryGrasp(std::mt19937_64* random);
  FingerPlacement SolveGrasp();
  void MakeBonds();
  void MakeMismatch(const std::string& mjcf);
  /// Stiffness and damping of a law that has them: the scenario's, or those that follow from its gains.
  [[nodiscard]] ObjectStiffness FindStiffness(const GraspControllerOptions& options) const;

  Scenario scenario_;
  RobotModel model_;
  std::unique_ptr<RobotModel> plant_model_;
  MjModelPtr engine_;
  std::unique_ptr<Adapter> adapter_;
  std::optional<RobotModel> known_model_;  // these four only with a mismatch
  MjModelPtr controller_engine_;
  std::unique_ptr<Adapter> plant_side_, controller_side_;
  ConstantChecks constants_;
  Solids solids_;
  std::vector<WatchedPair> watched_pairs_;
  std::unique_ptr<Surface> surface_;
  std::vector<int> fingertips_;
  Hand hand_;
  std::vector<int> arm_joints_;
  std::vector<int> idle_joints_;
  std::vector<Bond> bonds_;
  std::vector<int> bond_constraints_;
  std::vector<ContactCoordinates> kappa_start_;
  /// What the terms of an object are evaluated of where there is none: numbers that nobody reads.
  ObjectModel no_object_{
      .name = "", .shape = SolidSphere{1.0}, .body = {1.0, Vector3d::Zero(), Matrix3d::Identity()}};
  std::optional<JointMotion> joint_motion_;
  JointGains joint_gains_;
  VectorXd q_start_;
  Pose X_Bo_start_ = Pose::Identity();
  Vector6d X_start_ = Vector6d::Zero();
};

}  // namespace dexcheck
