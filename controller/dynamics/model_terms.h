#pragma once

// Kinematics and dynamics of the robot (sections 2 and 3) at one state.

#include <vector>

#include "controller/common/types.h"
#include "controller/dynamics/term_types.h"
#include "controller/model/robot_model.h"

namespace dexcheck {

/// Workspace for the terms of one model at one state. Sized by the constructor; nothing else allocates.
///
/// Everything is computed in the inertial frame that coincides with Sigma_0 at this instant, so the results
/// do not lose digits far from the world's origin. Motion vectors are pairs (angular w, linear v at that
/// origin). Each velocity coordinate i has a column S_i = (w_i, v_i) and its time derivative S_dot_i; then
///   M_ij = integral J_i . J_j dm,   C_ij = integral J_i . J_dot_j dm,
/// with J_i = v_i + w_i x p the velocity of a mass element at p. This C is the Christoffel choice; with the
/// columns of a nonholonomic base (12) it is S^T C S + S^T M S_dot of (14).
class ModelTerms {
 public:
  /// The model must outlive the workspace.
  explicit ModelTerms(const RobotModel& model, Coordinates coordinates = Coordinates::kReduced);
  explicit ModelTerms(RobotModel&&, Coordinates = Coordinates::kReduced) = delete;

  /// Poses and velocities of all links; the other calls read what this one stores.
  /// @param q q', num_positions entries, rad and m.
  /// @param velocity xi (reduced) or q_dot' (unreduced), rad/s and m/s.
  /// @throws std::invalid_argument when a size is wrong.
  void SetState(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& velocity);

  /// M, C, and F's two parts at the state set before. Cost grows with joints times depth.
  void CalcDynamics();

  /// M, F's two parts, and C velocity by the recursive Newton-Euler equations, at half the cost: C() stays as
  /// it was. @throws std::invalid_argument for unreduced coordinates that have more entries.
  void CalcMassAndCoriolis();

  [[nodiscard]] const RobotModel& model() const { return *model_; }
  /// Number of velocity coordinates: 50 (reduced) or 51 (unreduced) for the paper's robot.
  [[nodiscard]] int size() const { return size_; }
  /// xi or q_dot' as set before.
  [[nodiscard]] const VectorXd& velocity() const { return velocity_; }

  // Results of CalcDynamics, each size x size or size.
  /// M of (16), or M_bar' of (18); symmetric positive definite; kg m^2, kg m, kg.
  [[nodiscard]] const MatrixXd& M() const { return M_; }
  /// C of (16), or C_bar' of (18): Christoffel choice, M_dot - 2 C is skew (Property 2).
  [[nodiscard]] const MatrixXd& C() const { return C_; }
  /// C velocity, of CalcMassAndCoriolis, N m or N.
  [[nodiscard]] const VectorXd& coriolis() const { return coriolis_; }
  /// Part of F due to gravity, N m or N.
  [[nodiscard]] const VectorXd& gravity() const { return gravity_; }
  /// Part of F due to viscous friction, N m or N.
  [[nodiscard]] const VectorXd& friction() const { return friction_; }

  /// ^B T_f of a frame of the model, equation (5): its pose in the world.
  [[nodiscard]] Pose CalcFramePose(int frame) const;
  /// Pose of a link's MDH frame in the world, by the index of its joint; -1 is Sigma_0.
  [[nodiscard]] Pose CalcLinkPose(int joint) const;

  /// J_f of (6) as a body Jacobian, and its time derivative: V^f_Bf = J velocity, in the frame's own axes,
  /// V = [linear; angular]. Both 6 x size; every entry is written.
  void CalcFrameJacobian(int frame, Eigen::Ref<Matrix6Xd> J, Eigen::Ref<Matrix6Xd> J_dot) const;

  /// Calculates only the columns whose coordinates move the frame; the others, zero in J_f, are not written.
  void CalcFrameColumns(int frame, Eigen::Ref<Matrix6Xd> J, Eigen::Ref<Matrix6Xd> J_dot) const;

  /// Velocity of a link's frame, [linear; angular] of its origin in world axes, by the index of its joint; -1
  /// is Sigma_0.
  [[nodiscard]] Vector6d CalcLinkVelocity(int joint) const;

  /// Energies and momenta at the state set before; needs CalcDynamics.
  [[nodiscard]] EnergyAndMomentum CalcEnergyAndMomentum() const;

 private:
  /// One coordinate's column (w, v) and its derivative (w_dot, v_dot).
  struct Column {
    Vector3d w = Vector3d::Zero();
    Vector3d v = Vector3d::Zero();
    Vector3d w_dot = Vector3d::Zero();
    Vector3d v_dot = Vector3d::Zero();
  };
  /// State of a link: rotation, origin, twist.
  struct LinkState {
    Matrix3d R = Matrix3d::Identity();
    Vector3d p = Vector3d::Zero();
    Vector3d w = Vector3d::Zero();
    Vector3d v = Vector3d::Zero();
  };
  /// Integrals over the mass of a link and all that it carries: of 1, p, p p^T (six entries), p_dot, p_dot
  /// p^T.
  struct MassIntegrals {
    double m = 0.0;
    double mp[3] = {0.0, 0.0, 0.0};
    double P[6] = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};  // xx, xy, xz, yy, yz, zz
    double h[3] = {0.0, 0.0, 0.0};
    double Q[9] = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};  // row-major, Q_ij = integral p_dot_i p_j

    MassIntegrals& operator+=(const MassIntegrals& other);
  };
  /// Derivative of a link's twist at zero acceleration, and the force that this needs about the origin.
  struct LinkForce {
    Vector3d w_dot = Vector3d::Zero(), v_dot = Vector3d::Zero();
    Vector3d moment = Vector3d::Zero(), force = Vector3d::Zero();
  };
  /// Constant mass properties of a link about its frame's origin, for the tree's recursion.
  struct LinkMass {
    double m;
    Vector3d mc;  // m times centre of mass
    double P[6];  // second moments
  };
  /// Constants of a joint's place in the tree.
  struct JointPlace {
    int parent;
    JointType type;
    bool has_offset;
    double cos_alpha, sin_alpha, a, q, d;
    Matrix3d R_offset;
    Vector3d p_offset;
  };

  // Columns of the path are processed in blocks of this many; the rows of path_ are padded to a multiple.
  static constexpr int kPathBlock = 8;
  static int PaddedPathLength(int length) { return (length + kPathBlock - 1) / kPathBlock * kPathBlock; }

  void SetBaseState(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& velocity);
  void SetBaseColumns(const Vector3d& base_linear_velocity);
  void SetFloatingColumns();
  void SetJointState(int joint, double q, double rate);
  void SetBallState(int joint, const Eigen::Quaterniond& turn, const Vector3d& rates);
  [[nodiscard]] Column& joint_column(int joint, int k = 0) {
    return columns_[static_cast<size_t>(base_size_ + model_->dof(joint) + k)];
  }
  static MassIntegrals CalcLinkIntegrals(const LinkMass& mass, const LinkState& state);
  void PushColumn(int depth, const Column& column, int dof);
  void CalcCoriolis();
  /// Sums the links' integrals up to the subtrees', and fills M, C if with_C, gravity and friction from them.
  template <bool with_C>
  void Fill();
  template <bool with_C>
  void FillRowAndColumn(int depth, int dof, const Column& column, const MassIntegrals& subtree);
  void AddWheelsAndRotors();
  [[nodiscard]] const LinkState& link(int joint) const { return links_[static_cast<size_t>(joint + 1)]; }

  const RobotModel* model_;
  int base_size_;  // velocity coordinates of the base
  int size_;

  std::vector<JointPlace> places_;
  std::vector<LinkMass> masses_;                // base first
  std::vector<std::vector<int>> frame_chains_;  // per frame: entries of its chain's joints

  double phi_ = 0.0;
  Vector3d base_position_ = Vector3d::Zero();
  Matrix3d base_R_ = Matrix3d::Identity();
  Eigen::Vector2d wheel_rates_ = Eigen::Vector2d::Zero();  // right, left
  Eigen::Matrix<double, 2, 3> wheel_map_ =
      Eigen::Matrix<double, 2, 3>::Zero();  // rates = map * base velocity
  VectorXd velocity_;
  std::vector<Column> columns_;          // base columns first
  std::vector<LinkState> links_;         // base first
  std::vector<MassIntegrals> subtrees_;  // base first
  std::vector<LinkForce> forces_;        // base first

  // The columns from the base to the joint at hand, one row a component: w, v, w_dot, v_dot; padded.
  Eigen::Matrix<double, 12, Eigen::Dynamic, Eigen::RowMajor> path_;
  std::vector<int> path_dofs_;
  VectorXd path_M_, path_C_column_, path_C_row_;

  MatrixXd M_;
  MatrixXd C_;
  VectorXd coriolis_;
  VectorXd gravity_;
  VectorXd friction_;
};

}  // namespace dexcheck
