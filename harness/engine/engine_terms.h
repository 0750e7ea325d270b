#pragma once

#include <vector>

#include "controller/dynamics/model_terms.h"
#include "harness/adapter/velocity_map.h"
#include "harness/engine/engine.h"

namespace dexcheck {

/// Mass properties of a link in the world at the state set: centre of mass, and inertia about it in world
/// axes.
struct LinkInWorld {
  double mass = 0.0;
  Vector3d com = Vector3d::Zero();
  Matrix3d inertia = Matrix3d::Zero();
};

/// The engine's own values of the analytic model's terms, projected on the same coordinates. Works in a
/// private copy of the engine's model and data, at states without tilt and with rolling wheels, so that a
/// disagreement is a disagreement of models.
class EngineTerms {
 public:
  EngineTerms(const Adapter& adapter, Coordinates coordinates);

  /// Kinematics and dynamics at q' and velocity (xi or q_dot'). The object stays where its body starts.
  void SetState(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& velocity);

  [[nodiscard]] int size() const { return map_.size(); }
  /// T^T M T.
  [[nodiscard]] const MatrixXd& M() const { return M_; }
  /// Coriolis and centrifugal forces T^T (bias(q, qvel) without gravity + M T_dot velocity) = C velocity.
  [[nodiscard]] const VectorXd& coriolis() const { return coriolis_; }
  /// T^T of gravity's part of the bias force.
  [[nodiscard]] const VectorXd& gravity() const { return gravity_; }
  /// Minus T^T of the engine's passive forces: damping, and whatever else the MJCF has (springs, fluid).
  [[nodiscard]] const VectorXd& friction() const { return friction_; }
  [[nodiscard]] const EnergyAndMomentum& energy_and_momentum() const { return energy_; }
  /// Links, base first.
  [[nodiscard]] const std::vector<LinkInWorld>& links() const { return links_; }

  /// Coriolis force at another velocity, for the polarisation of C; changes the stored velocity-dependent
  /// state.
  void CalcCoriolis(const Eigen::Ref<const VectorXd>& velocity, Eigen::Ref<VectorXd> result);

  /// Axis direction and a point on the axis of a joint, world frame.
  [[nodiscard]] Vector3d JointAxis(int joint) const;
  [[nodiscard]] Vector3d JointAnchor(int joint) const;
  /// Pose of a frame's site. The frame must have one.
  [[nodiscard]] Pose FramePose(int frame) const;
  /// Jacobian J T of a frame's site, [linear; angular] in world axes, 6 x size.
  void CalcFrameJacobian(int frame, Eigen::Ref<Matrix6Xd> J);
  /// J_dot velocity of a frame's site, [linear; angular] in world axes. Valid right after SetState.
  [[nodiscard]] Vector6d CalcFrameBiasAcceleration(int frame) const;

  [[nodiscard]] const Adapter& adapter() const { return *adapter_; }

 private:
  void CalcEnergyAndMomentum();

  const Adapter* adapter_;
  MjModelPtr engine_;  // gravity is switched on and off here
  MjDataPtr data_;
  VelocityMap map_;
  VectorXd q_;
  VectorXd bias_nv_;
  VectorXd force_nv_;
  MatrixXd M_nv_;
  MatrixXd M_;
  VectorXd coriolis_, gravity_, friction_;
  RowMatrixXd J_nv_;
  MatrixXd J_;
  std::vector<LinkInWorld> links_;
  EnergyAndMomentum energy_;
};

}  // namespace dexcheck
