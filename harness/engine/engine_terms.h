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

  /// C(velocity) w, which only C's matrix knows; both at the q' of SetState. With the forces c(x) = C(x) x,
  ///   C(x) w = (c(x + w) - c(x - w)) / 4 + T^T M (T_dot(x) w - T_dot(w) x) / 2,
  /// since without the second part, which is zero where velocities are rates of coordinates, the Christoffel
  /// choice has C(x) w = C(w) x. Changes the stored velocity-dependent state.
  void CalcCoriolisProduct(const Eigen::Ref<const VectorXd>& velocity, const Eigen::Ref<const VectorXd>& w,
                           Eigen::Ref<VectorXd> result);

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
  /// Coriolis force at a velocity.
  void CalcCoriolis(const Eigen::Ref<const VectorXd>& velocity, Eigen::Ref<VectorXd> result);
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
  VectorXd velocity_, force_;  // scratch of CalcCoriolisProduct
  RowMatrixXd J_nv_;
  MatrixXd J_;
  std::vector<LinkInWorld> links_;
  EnergyAndMomentum energy_;
};

}  // namespace dexcheck
