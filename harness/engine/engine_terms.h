#pragma once

// The engine's terms of robot, object and contacts at one state.

#include <span>
#include <vector>

#include "controller/dynamics/term_types.h"
#include "controller/model/robot_model.h"
#include "harness/engine/engine.h"
#include "harness/engine/velocity_map.h"

namespace dexcheck {

/// Motion of a point of a body at constant xi and V_Bo, world axes.
struct EngineMotion {
  Vector3d p = Vector3d::Zero();      ///< Position of the point, m.
  Vector3d v = Vector3d::Zero();      ///< m/s
  Vector3d omega = Vector3d::Zero();  ///< Angular velocity of the body, rad/s.
  Vector3d a = Vector3d::Zero();      ///< m/s^2
  Vector3d alpha = Vector3d::Zero();  ///< Angular acceleration of the body, rad/s^2.

  /// Returns the motion of another point of the body, at `point` in the world.
  [[nodiscard]] EngineMotion MoveTo(const Vector3d& point) const;
};

/// Contact of a fingertip and the object by the engine's narrow phase.
struct EngineTouch {
  bool found = false;
  double distance = 0.0;                 ///< m, negative when the bodies overlap.
  Vector3d position = Vector3d::Zero();  ///< Midway between the surfaces, world, m.
  Vector3d normal = Vector3d::Zero();    ///< From the fingertip into the object, world.
};

/// Positions that the engine has evaluated already.
struct EvaluatedPositions {
  const mjData* data = nullptr;  ///< Of the same model, at the same q' and X_Bo but for the base's pose.
  Pose X_W0 = Pose::Identity();  ///< That pose, of Sigma_0.
};

/// The engine's own values of the analytic model's terms, in the same coordinates. Works in a private copy of
/// the engine's model and data, at states without tilt and with rolling wheels, so that a disagreement is a
/// disagreement of models. Only a Jacobian's columns that can differ from zero by the engine's tree are
/// formed, which is fast enough for every step of a run. Functions that return a matrix by value or have
/// "whole" in their description are for single states. The others do not allocate after construction.
class EngineTerms {
 public:
  /// Evaluates all frames, and the object if there is one that moves by a free joint; no contacts.
  EngineTerms(const Adapter& adapter, Coordinates coordinates);
  /// Evaluates these fingertips alone, with their contacts, in reduced coordinates.
  /// @throws InputError when a fingertip has no sphere that can touch, or the object does not move by a free
  /// joint alone or cannot touch.
  EngineTerms(const Adapter& adapter, std::span<const int> fingertips);

  /// @throws InputError when the object does not move by a free joint alone.
  void RequireObject() const;

  /// Evaluates robot and object at q', velocity (xi or q_dot'), the object's pose and body velocity.
  /// @param evaluated the positions, if `data` is not null: they are not evaluated once more then. The terms
  /// are those of the upright base all the same.
  void SetState(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& velocity,
                const Pose& X_Bo = Pose::Identity(), const Vector6d& V_Bo = Vector6d::Zero(),
                const EvaluatedPositions& evaluated = {});

  /// Number n of velocity coordinates.
  [[nodiscard]] int size() const { return map_.size(); }
  /// T^T M T, n x n.
  [[nodiscard]] const MatrixXd& M() const { return M_; }
  /// Coriolis and centrifugal forces T^T (bias(q, qvel) without gravity + M T_dot velocity) = C velocity.
  [[nodiscard]] const VectorXd& coriolis() const { return coriolis_; }
  /// T^T of the weights that each dof moves.
  [[nodiscard]] const VectorXd& gravity() const { return gravity_; }
  /// Minus T^T of the engine's passive forces: damping, and all others of the MJCF (springs, fluid).
  [[nodiscard]] const VectorXd& friction() const { return friction_; }
  /// Calculates C(velocity) w, which depends on the choice of C's matrix; both at the q' of SetState. With
  /// the forces c(x) = C(x) x,
  ///   C(x) w = (c(x + w) - c(x - w)) / 4 + T^T M (T_dot(x) w - T_dot(w) x) / 2,
  /// since the Christoffel choice has C(x) w = C(w) x but for the second part, which is zero where velocities
  /// are rates of coordinates. Changes the quantities that depend on the velocity: call it last.
  void CalcCoriolisProduct(const Eigen::Ref<const VectorXd>& velocity, const Eigen::Ref<const VectorXd>& w,
                           Eigen::Ref<VectorXd> result);
  /// Energy and momentum of the robot.
  [[nodiscard]] const EnergyAndMomentum& energy_and_momentum() const { return energy_; }

  /// Links in the world, base first.
  [[nodiscard]] std::vector<MassProperties> links() const;
  /// Axis of a joint (of a ball joint the x, y or z axis of its body) and a point on it, world frame.
  [[nodiscard]] Vector3d JointAxis(int joint, int column = 2) const;
  [[nodiscard]] Vector3d JointAnchor(int joint) const;

  /// The way from the upright base to the base of the positions that were evaluated already.
  [[nodiscard]] const Pose& tilt() const { return tilt_; }
  /// Pose of Sigma_0.
  [[nodiscard]] Pose BasePose() const { return adapter_->GetBasePose(data_->qpos); }
  [[nodiscard]] Pose FramePose(int frame) const;

  /// Velocity coordinates that move a frame, ascending, by the engine's own tree.
  [[nodiscard]] const std::vector<int>& chain(int frame) const { return chain_of(frame).coordinates; }
  /// Jacobian of a frame's origin, [linear; angular] in world axes as tilt() turns them: 6 x chain columns.
  void CalcFrameColumns(int frame, Eigen::Ref<Matrix6Xd> J) const;
  /// The whole Jacobian of a frame's origin, 6 x n.
  [[nodiscard]] Matrix6Xd CalcFrameJacobian(int frame) const;
  /// Motion of a frame's origin.
  [[nodiscard]] EngineMotion FrameMotion(int frame) const;

  // The object: M_hat V_dot + C_hat V + N_o = F_o, in Sigma_o.
  [[nodiscard]] Pose ObjectPose() const;
  /// Body velocity, from the engine's velocities.
  [[nodiscard]] Vector6d ObjectVelocity() const;
  [[nodiscard]] EngineMotion ObjectMotion() const;
  [[nodiscard]] Matrix6d ObjectInertia() const;
  /// C_hat V_Bo.
  [[nodiscard]] const Vector6d& ObjectCoriolis() const { return object_coriolis_; }
  /// N_o.
  [[nodiscard]] const Vector6d& ObjectGravity() const { return object_gravity_; }
  /// Rows of a point's velocity by V_Bo, world axes.
  [[nodiscard]] Eigen::Matrix<double, 3, 6> CalcObjectJacobian(const Vector3d& point) const;

  /// Calculates the narrow phase of a fingertip's frame and the object, with the robot moved by `shift`.
  [[nodiscard]] EngineTouch CalcTouch(int frame, const Pose& shift);

 private:
  /// Coordinates that move a frame.
  struct Chain {
    int tip_geom = -1;             ///< Sphere of a fingertip that can touch.
    std::vector<int> coordinates;  ///< The base's come first.
    std::vector<int> dofs;         ///< The engine's dofs of the joints among them.
  };

  EngineTerms(const Adapter& adapter, Coordinates coordinates, std::span<const int> frames);
  [[nodiscard]] const Chain& chain_of(int frame) const { return chains_[static_cast<size_t>(frame)]; }
  [[nodiscard]] int body_of(int frame) const { return adapter_->frame_bodies()[static_cast<size_t>(frame)]; }
  /// A frame's origin in the world.
  [[nodiscard]] const mjtNum* PlaceOf(int frame) const;
  /// Motion of a point that a dof moves, per its rate: [linear; angular], world axes.
  [[nodiscard]] Vector6d CalcPointColumn(int dof, const Vector3d& point) const;
  void FindObject();
  void FindTouchingGeoms(std::span<const int> fingertips);
  /// Keeps the engine from placing geoms in every state, unless a force depends on them.
  void DropGeoms();
  void ListChains(std::span<const int> frames);
  void SetPositions(const Eigen::Ref<const VectorXd>& q, const Pose& X_Bo,
                    const EvaluatedPositions& evaluated);
  void TakePositions(const mjData& from);
  /// Moves what the engine has at its base's pose to the upright base.
  [[nodiscard]] Vector3d Turn(const Vector3d& vector) const { return tilt_.linear().transpose() * vector; }
  [[nodiscard]] Vector3d Move(const Vector3d& point) const { return Turn(point - tilt_.translation()); }
  void SetVelocities(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& velocity,
                     const Vector6d& V_Bo);
  void ListMass();
  void CalcMass(const mjData& evaluated);
  void CalcForces();
  void CalcBiasForce();
  void CalcCoriolis(const Eigen::Ref<const VectorXd>& velocity, Eigen::Ref<VectorXd> result);
  void CalcBodyAccelerations();
  void CalcEnergyAndMomentum();
  [[nodiscard]] EngineMotion ReadMotion(mjtObj type, int id, const mjtNum* place) const;
  [[nodiscard]] Matrix3d ObjectRotation() const;
  /// The object's part of force_nv_, in Sigma_o.
  [[nodiscard]] Vector6d ObjectForce() const;

  const Adapter* adapter_;
  MjModelPtr engine_;  // without gravity; places no geoms unless forces need them
  MjDataPtr data_;
  VelocityMap map_;
  int base_size_;
  int carrying_dofs_;  // the base's without the wheels
  VectorXd q_;

  Pose tilt_ = Pose::Identity();

  /// An entry of the engine's M that can differ from zero, row >= col.
  struct MassEntry {
    int row, col, address;
    int own_row, own_col;  // of M(); -1 for a dof of the base or of no part
  };
  std::vector<MassEntry> mass_entries_;
  MatrixXd M_;
  MatrixXd mass_nv_;  // of all the engine's dofs
  VectorXd force_nv_, bracket_nv_;
  VectorXd coriolis_, gravity_, friction_;
  VectorXd other_velocity_, other_force_;  // scratch of CalcCoriolisProduct
  EnergyAndMomentum energy_;

  std::vector<int> robot_bodies_;
  std::vector<Chain> chains_;  // by frame; empty unless requested

  int object_body_;
  bool has_object_ = false;
  std::vector<int> object_geoms_;
  Vector6d object_coriolis_ = Vector6d::Zero();
  Vector6d object_gravity_ = Vector6d::Zero();
};

}  // namespace dexcheck
