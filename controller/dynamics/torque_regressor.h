#pragma once

// The joint torques of a motion, and what they are linear in.

#include <vector>

#include "controller/common/types.h"
#include "controller/model/robot_model.h"

namespace dexcheck {

/// How Sigma_0 moves, in world axes.
struct BaseMotion {
  Matrix3d R = Matrix3d::Identity();  ///< Of Sigma_0.
  Vector3d w = Vector3d::Zero();      ///< Angular velocity, rad/s.
  Vector3d w_dot = Vector3d::Zero();  ///< rad/s^2
  Vector3d a = Vector3d::Zero();      ///< Acceleration of the origin, m/s^2.
};

/// Inverse dynamics of the joints of a tree whose base moves as prescribed, by the Newton-Euler equations of
/// each link in its own axes; an independent derivation of M_bar' xi_dot + C_bar' xi + F_bar' of (18).
/// Friction is no part of it. Nothing allocates after construction.
class TorqueRegressor {
 public:
  /// Number of a link's parameters in which the torques are linear: its mass, mass times centre of mass (3),
  /// and the inertia about the origin of its frame: xx, yy, zz, xy, xz, yz; in the axes of frame i.
  static constexpr int kBody = 10;
  using BodyVector = Eigen::Matrix<double, kBody, 1>;

  /// The model must outlive this. @throws InputError when it has ball joints.
  explicit TorqueRegressor(const RobotModel& model);
  explicit TorqueRegressor(RobotModel&&) = delete;

  /// The motion of all links. @param q, qd, qdd n, in the model's order: rad or m, and per s, per s^2.
  void SetMotion(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& qd,
                 const Eigen::Ref<const VectorXd>& qdd, const BaseMotion& base = {});

  /// Torques of the model's bodies and armatures at that motion (n), N m or N.
  void CalcTorques(Eigen::Ref<VectorXd> torques) const;
  /// Their derivatives by each link's BodyVector (n x kBody n, by link), with CalcTorques = sum over them and
  /// armatures.
  void CalcBodyColumns(Eigen::Ref<MatrixXd> columns) const;
  /// Those of one link (n x kBody).
  void CalcBodyColumns(int link, Eigen::Ref<MatrixXd> columns) const;
  /// Their derivatives by gravity (n x 3), world axes.
  void CalcGravityColumns(Eigen::Ref<MatrixXd> columns) const;
  /// Joint torques that balance a force (world axes) at a link's centre of mass and a moment on it: J^T, n
  /// x 6.
  void CalcForceColumns(int link, Eigen::Ref<MatrixXd> columns) const;

  /// Axes of a link's frame at that motion, in world axes.
  [[nodiscard]] const Matrix3d& GetRotation(int link) const { return links_[static_cast<size_t>(link)].R; }

  [[nodiscard]] const RobotModel& model() const { return *model_; }
  [[nodiscard]] int size() const { return model_->num_joints(); }
  static BodyVector Pack(const MassProperties& body);
  /// The body of such a vector; of no mass, all at the origin.
  static MassProperties Unpack(const BodyVector& vector);

 private:
  /// Motion of a link's frame, world axes.
  struct Link {
    Matrix3d R;
    Vector3d p, w, w_dot, a;  // a: of the origin, less gravity
  };
  [[nodiscard]] Vector3d axis(int joint) const { return links_[static_cast<size_t>(joint)].R.col(2); }
  [[nodiscard]] bool is_revolute(int joint) const {
    return model_->joint(joint).type == JointType::kRevolute;
  }

  const RobotModel* model_;
  std::vector<BodyVector> bodies_;
  std::vector<std::vector<int>> chains_;  // of each link: its joints, from the base
  std::vector<Link> links_;
  VectorXd qdd_;
};

/// The pseudo-inertia of a body (4 x 4): its second moments about the frame's origin, mass times centre, and
/// mass. That of every body that fills a volume is positive definite.
Eigen::Matrix4d CalcPseudoInertia(const TorqueRegressor::BodyVector& body);
/// Whether there is a body of such mass, centre and inertia.
bool IsBody(const TorqueRegressor::BodyVector& body);
/// The nearest one that there is: of least distance between pseudo-inertias.
TorqueRegressor::BodyVector FindNearestBody(const TorqueRegressor::BodyVector& body);

}  // namespace dexcheck
