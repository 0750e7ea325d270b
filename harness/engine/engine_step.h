#pragma once

// The engine's terms of robot, object and grasp at one state: EngineTerms in what one step of a run can
// afford.

#include <span>
#include <vector>

#include "controller/dynamics/model_terms.h"
#include "harness/adapter/velocity_map.h"
#include "harness/engine/engine.h"

namespace dexcheck {

/// Motion of a point of a body at constant xi and V_Bo, world axes.
struct EngineMotion {
  Vector3d p = Vector3d::Zero();      ///< Where the point is, m.
  Vector3d v = Vector3d::Zero();      ///< m/s
  Vector3d omega = Vector3d::Zero();  ///< Of the body, rad/s.
  Vector3d a = Vector3d::Zero();      ///< m/s^2
  Vector3d alpha = Vector3d::Zero();  ///< Of the body, rad/s^2.

  /// The same of another point of the body, at `point` in the world.
  [[nodiscard]] EngineMotion MoveTo(const Vector3d& point) const;
};

/// Where the engine's narrow phase has a fingertip and the object meet.
struct EngineTouch {
  bool found = false;
  double distance = 0.0;                 ///< m, negative when the bodies overlap.
  Vector3d position = Vector3d::Zero();  ///< Midway between the surfaces, world, m.
  Vector3d normal = Vector3d::Zero();    ///< From the fingertip into the object, world.
};

/// Entry of M_bar', row >= col.
struct MassEntry {
  int row;
  int col;
};

/// One evaluation of the engine at the projected state: no tilt, rolling wheels, reduced coordinates. Works
/// in a private copy of the engine's model and data. Only what a tree can have different from zero is formed.
/// Nothing allocates after construction.
class EngineStep {
 public:
  /// @param fingertips frames that carry spheres.
  /// @throws InputError when a fingertip has no sphere that can touch, or the object does not move by a free
  /// joint alone or cannot touch.
  EngineStep(const Adapter& adapter, std::span<const int> fingertips);

  /// Evaluates everything but what the calls below calculate.
  void SetState(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& xi, const Pose& X_Bo,
                const Vector6d& V_Bo);

  /// n, entries of xi.
  [[nodiscard]] int size() const { return map_.size(); }
  /// Entries of M_bar' that can differ from zero, and their values.
  [[nodiscard]] const std::vector<MassEntry>& mass_entries() const { return mass_entries_; }
  [[nodiscard]] const VectorXd& mass() const { return mass_; }
  /// C_bar' xi, and the two parts of F_bar'.
  [[nodiscard]] const VectorXd& coriolis() const { return coriolis_; }
  [[nodiscard]] const VectorXd& gravity() const { return gravity_; }
  [[nodiscard]] const VectorXd& friction() const { return friction_; }
  /// Of the robot.
  [[nodiscard]] const EnergyAndMomentum& energy_and_momentum() const { return energy_; }

  /// Pose of Sigma_0.
  [[nodiscard]] Pose BasePose() const { return adapter_->GetBasePose(data_->qpos); }
  [[nodiscard]] Pose FramePose(int frame) const;

  /// Velocity coordinates that move a fingertip (by its place in the grasp), ascending.
  [[nodiscard]] const std::vector<int>& chain(int finger) const {
    return chains_[static_cast<size_t>(finger)];
  }
  /// Jacobian of a point of a fingertip's body, [linear; angular] in world axes: 6 x chain columns.
  void CalcTipJacobian(int finger, const Vector3d& point, Eigen::Ref<Matrix6Xd> J);
  [[nodiscard]] EngineMotion TipMotion(int finger) const;

  // The object: M_hat V_dot + C_hat V + N_o = F_o, in Sigma_o.
  [[nodiscard]] Pose ObjectPose() const;
  /// Body velocity, back from the engine's.
  [[nodiscard]] Vector6d ObjectVelocity() const;
  [[nodiscard]] EngineMotion ObjectMotion() const;
  [[nodiscard]] Matrix6d ObjectInertia() const;
  /// C_hat V_Bo.
  [[nodiscard]] Vector6d ObjectCoriolis() const;
  /// N_o.
  [[nodiscard]] Vector6d ObjectGravity() const;
  /// Rows of a point's velocity by V_Bo, world axes.
  [[nodiscard]] Eigen::Matrix<double, 3, 6> CalcObjectJacobian(const Vector3d& point);

  /// The narrow phase on a fingertip and the object, with the robot carried by `shift` from where it is.
  [[nodiscard]] EngineTouch CalcTouch(int finger, const Pose& shift);

 private:
  void FindObject();
  void ListMassEntries();
  void ListChains(std::span<const int> fingertips);
  void SetPositions(const Eigen::Ref<const VectorXd>& q, const Pose& X_Bo);
  void SetVelocities(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& xi,
                     const Vector6d& V_Bo);
  void CalcMass();
  void CalcForces();
  void CalcBodyAccelerations();
  void CalcEnergyAndMomentum();
  [[nodiscard]] EngineMotion ReadMotion(mjtObj type, int id, const mjtNum* place) const;
  [[nodiscard]] Matrix3d ObjectRotation() const;

  const Adapter* adapter_;
  MjModelPtr engine_;  // without gravity; places no geoms
  MjDataPtr data_;
  VelocityMap map_;
  int base_size_;
  int carrying_dofs_;  // the base's without the wheels

  std::vector<MassEntry> mass_entries_;
  // By joint: address in qM of its entry with the base's first dof; the following dofs' are before it.
  std::vector<int> base_entries_;
  std::vector<int> joint_entries_;  // addresses in qM of the entries between joints, in mass_entries' order
  VectorXd mass_;
  MatrixXd base_mass_;  // scratch, among base_dofs
  VectorXd force_nv_;
  VectorXd coriolis_, gravity_, friction_;
  EnergyAndMomentum energy_;

  std::vector<int> robot_bodies_;
  std::vector<int> moving_bodies_;  // those whose accelerations are needed, parents first
  std::vector<int> tip_sites_, tip_bodies_, tip_geoms_;
  std::vector<std::vector<int>> chains_;      // velocity coordinates
  std::vector<std::vector<int>> chain_dofs_;  // the engine's, of the joints among them
  RowMatrixXd J_nv_;

  int object_body_;
  std::vector<int> object_geoms_;
  int object_qpos_ = 0;
  int object_dof_ = 0;
  VectorXd object_force_;  // C_hat V, N_o in the engine's coordinates
};

}  // namespace dexcheck
