#pragma once

// The map between the two worlds: which joint, body and site of the engine's model is which of the analytic
// model, and how coordinates and velocities translate.

#include <mujoco/mujoco.h>

#include <array>
#include <set>
#include <string>
#include <vector>

#include "controller/common/types.h"
#include "controller/model/robot_model.h"

namespace dexcheck {

/// A driving wheel of the MJCF, read from the engine's model alone and not from the parameters.
struct EngineWheel {
  int joint = -1;
  int dof = -1;
  double radius = 0.0;       ///< Radius of the round geom that touches the floor, m.
  Vector3d center{0, 0, 0};  ///< In Sigma_0 at the reference pose, m.
  Vector3d axis{0, 1, 0};    ///< Hinge axis in Sigma_0; +y makes positive rates roll forward.
};

/// Matches the analytic model with an engine's model by joint and body names and maps q', xi to qpos, qvel.
///
/// q_i is the engine's position of the joint of the same name; a ball joint has its quaternion. The base's
/// q_v = 0 is the pose that the MJCF gives to the base's body. The base may move by a free joint, or by two
/// slides and a hinge; a differential drive also has a hinge per wheel. A floating base's Sigma_0 is the
/// frame of its body, which moves by a free joint: its q_v and v are the engine's. qvel = T velocity, where T
/// has dense base columns and one entry per joint.
class Adapter {
 public:
  /// @throws InputError that lists the joints, bodies and sites that the other description lacks (the first
  /// few of many), or names one whose kind differs.
  Adapter(const RobotModel& model, const mjModel& engine, const std::string& engine_source);

  [[nodiscard]] const RobotModel& model() const { return *model_; }
  [[nodiscard]] const mjModel& engine() const { return *engine_; }

  /// Engine's joint id of each joint of the model.
  [[nodiscard]] const std::vector<int>& joint_ids() const { return joint_ids_; }
  /// Engine's dof address of each velocity of the model's joints.
  [[nodiscard]] const std::vector<int>& joint_dofs() const { return joint_dofs_; }
  /// Engine's body id of each link: base first, then by joint; -1 between several joints of one body.
  [[nodiscard]] const std::vector<int>& link_bodies() const { return link_bodies_; }
  /// All engine bodies that move as one with a link (welded to it), by the link's index + 1.
  [[nodiscard]] const std::vector<std::vector<int>>& welded_bodies() const { return welded_bodies_; }
  /// Engine's site of each frame of the model; -1 for a frame that is a body's: its link's, or that of a body
  /// of its name.
  [[nodiscard]] const std::vector<int>& frame_sites() const { return frame_sites_; }
  /// Engine's body that carries each frame.
  [[nodiscard]] const std::vector<int>& frame_bodies() const { return frame_bodies_; }
  /// Engine's geom of a fingertip (FindTipSphere). @throws InputError unless it can touch.
  [[nodiscard]] int RequireTipGeom(int frame) const;
  /// Engine's body of the object; -1 without one.
  [[nodiscard]] int object_body() const { return object_body_; }
  /// Addresses in qpos and qvel of the joint that moves it; -1 without one.
  [[nodiscard]] int object_qpos() const { return object_qpos_; }
  [[nodiscard]] int object_dof() const { return object_dof_; }
  /// Right and left wheel; empty unless the base is a differential drive.
  [[nodiscard]] const std::vector<EngineWheel>& wheels() const { return wheels_; }

  /// Engine's joints that are no part of the robot, since nothing joins them to it (robot_tree.h): objects in
  /// the scene beside a robot whose base is fixed or floats. They have no terms.
  [[nodiscard]] const std::vector<int>& other_joints() const { return other_joints_; }

  /// Engine's joints that move the base: none, a free joint, or slide, slide, hinge.
  [[nodiscard]] const std::vector<int>& base_joints() const { return base_joints_; }
  /// Calculates the rates of those joints' dofs when the base yaws and its anchor moves; the same map takes
  /// accelerations. The anchor is the point whose velocity the joints have: the free body's origin, or the
  /// hinge's axis. `rates` has 0, 6 or 3 entries.
  void CalcBaseRates(const Vector3d& anchor_velocity, double yaw_rate, Eigen::Ref<VectorXd> rates) const;
  /// Pose in Sigma_0 of the free joint's body, or of the hinge's anchor, which has axes along Sigma_0's.
  [[nodiscard]] const Pose& X_0b() const { return X_0b_; }
  /// The anchor in Sigma_0, m.
  [[nodiscard]] const Vector3d anchor() const { return X_0b_.translation(); }

  /// Sets the robot's part of qpos for q'. Wheel angles are set to zero, since q' does not have them.
  void SetPositions(const Eigen::Ref<const VectorXd>& q, mjtNum* qpos) const;

  /// Reads q' from the engine's qpos: a floating base's pose; otherwise yaw and midpoint, without the tilt.
  void GetPositions(const mjtNum* qpos, Eigen::Ref<VectorXd> q) const;
  /// Pose of Sigma_0 in the world, tilt and height included.
  [[nodiscard]] Pose GetBasePose(const mjtNum* qpos) const;
  /// Reads the motion of the base's anchor in world axes from the rates of its joints: linear and angular
  /// velocity from qvel, or linear and angular acceleration from qacc.
  void GetBaseMotion(const mjtNum* qpos, const mjtNum* rates, Vector3d* linear, Vector3d* angular) const;

 private:
  void MatchJoints(const std::string& engine_source);
  /// The trees of the engine's model in which the robot has joints; none when no joint is found.
  [[nodiscard]] std::set<int> FindTrees() const;
  void MatchBase(const std::string& engine_source);
  void MatchWheels(const mjData& reference, const std::string& engine_source);
  [[nodiscard]] double GetHingeYaw(const mjtNum* qpos) const;

  const RobotModel* model_;
  const mjModel* engine_;
  std::vector<int> joint_ids_;
  std::vector<int> joint_dofs_;
  std::vector<int> joint_qpos_;
  std::vector<int> link_bodies_;
  std::vector<std::vector<int>> welded_bodies_;
  std::vector<int> frame_sites_, frame_bodies_;
  std::vector<EngineWheel> wheels_;
  int object_body_ = -1, object_qpos_ = -1, object_dof_ = -1;

  std::vector<int> other_joints_;
  std::vector<int> base_joints_;
  bool base_is_free_ = false;
  Pose X_0b_ = Pose::Identity();                  // body of the free joint, or the hinge's anchor
  Vector3d reference_anchor_ = Vector3d::Zero();  // the hinge's anchor in the world at the reference pose
  std::array<Vector3d, 2> slide_axes_ = {Vector3d::UnitX(), Vector3d::UnitY()};
  double hinge_sign_ = 1.0;
};

}  // namespace dexcheck
