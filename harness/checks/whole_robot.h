#pragma once

// The robot and its object as the engine moves them, from the parameters, without assumptions on rolling, a
// level platform or a held object.

#include <mujoco/mujoco.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "controller/dynamics/model_terms.h"
#include "controller/model/robot_model.h"
#include "harness/comparison/rounding_scales.h"
#include "harness/engine/adapter.h"
#include "harness/plant/plant.h"

namespace dexcheck {

/// Makes the robot of a parameter file before the paper's constraint (1) reduces it: a base that moves as the
/// engine's does, freely, in the plane or not at all, and the wheels of a differential drive as joints in
/// front of the others. The base's frame is that of the engine's joints, so that the model's velocities are
/// the engine's except for signs and order.
RobotModel MakeWholeRobot(const RobotModel& model, const Adapter& adapter);

/// Equations of motion of the whole robot and its free object at the true state, in nu = [base; wheels;
/// joints; object's velocity in the world; its angular velocity in its own axes]:
///
///   M nu_dot + C nu + g + F nu = tau + J^T f
///
/// Nothing allocates after construction.
class WholeRobot {
 public:
  /// @param model parameters of the plant's robot. @param object of its object, if it has one. @param adapter
  /// between that model and the engine; outlives this.
  WholeRobot(const RobotModel& model, const MassProperties* object, const Adapter& adapter);

  [[nodiscard]] const RobotModel& model() const { return model_; }
  /// Entries of nu, 62 for the paper's robot and its torus; the robot's come first, 56.
  [[nodiscard]] Eigen::Index size() const { return bias_.size(); }
  [[nodiscard]] Eigen::Index robot_size() const { return terms_.size(); }

  /// "base, along x", "joint NAME", "object, about its z": an entry of nu.
  [[nodiscard]] std::string DescribeEntry(int entry) const;

  /// Numbers of FindLink beside the index of a link's joint and -1 for the base.
  static constexpr int kWorld = -2, kObject = -3, kNoLink = -4;
  /// Returns the part that one of the engine's bodies belongs to; kNoLink for other bodies.
  [[nodiscard]] int FindLink(int body) const { return body_links_[static_cast<size_t>(body)]; }
  /// The engine's joint of one of model().
  [[nodiscard]] int engine_joint(int joint) const { return joints_[static_cast<size_t>(joint)]; }
  /// Scales of the errors of M's entries (robot_size() x robot_size()).
  [[nodiscard]] MatrixXd CalcMassScales() const;

  /// Evaluates all terms at the engine's state. @param qpos, qvel as the engine's (nq, nv).
  void SetState(const mjtNum* qpos, const mjtNum* qvel);
  /// Positions of model() at that state.
  [[nodiscard]] const VectorXd& q() const { return q_; }
  [[nodiscard]] const VectorXd& nu() const { return nu_; }
  /// M of the robot's entries.
  [[nodiscard]] const MatrixXd& M() const { return terms_.M(); }
  /// Pose of a link or the object in the world.
  [[nodiscard]] Pose CalcLinkPose(int link) const {
    return link == kObject ? X_Bo_ : terms_.CalcLinkPose(link);
  }
  /// C nu + g + F nu (size()).
  [[nodiscard]] const VectorXd& bias() const { return bias_; }
  /// result += M a (size()).
  void AddInertia(const VectorXd& a, VectorXd* result) const;

  /// The engine's velocities, accelerations (nv) in the order and signs of nu.
  void ReadRates(const mjtNum* rates, VectorXd* nu) const;
  /// The engine's forces on its velocities (nv) as forces on nu.
  void ReadForces(const mjtNum* forces, VectorXd* result) const { ReadRates(forces, result); }
  /// Forces on the robot's part of nu as the engine's (nv); other entries are zero.
  void WriteForces(const VectorXd& forces, VectorXd* engine) const;
  /// Entries of nu that tau' and xi have, for wheels and joints; -1 for a base's.
  [[nodiscard]] const std::vector<Eigen::Index>& motor_entries() const { return motor_entries_; }

  // The engine's M and bias at the same state.
  /// Returns the largest difference of an entry of M from the engine's, over the size that the entry is
  /// summed up from, and its row. @param mass the engine's entries (GetMassEntries). The joints of a planar
  /// base may turn with it, so that its entries are compared in M_bar alone.
  [[nodiscard]] std::pair<double, int> CompareMass(const VectorXd& mass) const;
  /// Compares bias() the same way. @param bias the engine's (nv): Coriolis, gravity, less passive forces.
  [[nodiscard]] std::pair<double, int> CompareBias(const VectorXd& bias);

  /// Forgets all forces on bodies.
  void ClearForces();
  /// Adds a force and a torque on one of the engine's bodies, at a point of the world. Bodies that are part
  /// of neither robot nor object are passed over.
  void AddForce(const BodyForce& one);
  /// Adds a force on a link of the parameter file's model, by the index of its joint; -1 is the base.
  void AddLinkForce(int link, const BodyForce& one) { AddForce(link < 0 ? link : link + num_wheels_, one); }
  void AddObjectForce(const BodyForce& one) { AddForce(kObject, one); }
  /// Adds J^T f of all forces to `result`, and the sum of its summands' magnitudes to `size`; both size().
  void ProjectForces(VectorXd* result, VectorXd* size);

  /// Adds the sizes of the terms of M nu_dot and bias() by entry: rounding errors are relative to that.
  void AddSizes(const VectorXd& nu_dot, VectorXd* result) const;

 private:
  /// An entry of M that the tree lets differ from zero, row >= col.
  struct MassEntry {
    Eigen::Index row, col;
    double scale;
    int address;  // of the engine's; -1 where it has other coordinates
    double sign;  // of its axes
  };
  struct Load {
    Vector3d force = Vector3d::Zero(), moment = Vector3d::Zero();  // world, about the link's origin
    double size = 0.0;                                             // sum of |force| + |moment| / length, N
  };

  void AddForce(int link, const BodyForce& one);
  [[nodiscard]] double CalcObjectArm() const;  // m
  void ListMass();

  const Adapter* adapter_;
  int num_wheels_;
  RobotModel model_;
  ModelTerms terms_;
  RoundingScales scales_;
  std::optional<MassProperties> object_;
  std::vector<int> base_dofs_;  // the engine's
  MatrixXd base_rates_;         // the engine's rates of the base's joints from nu's
  std::vector<int> joints_;     // the engine's of wheels and joints
  std::vector<int> dofs_;       // the engine's of wheels and joints, in nu's order
  VectorXd signs_;              // of those
  std::vector<Eigen::Index> motor_entries_;
  std::vector<int> body_links_;  // by the engine's bodies; kNoLink, kObject
  std::vector<MassEntry> mass_entries_;
  VectorXd arms_, moved_, bias_sizes_;  // n: CalcVelocityScale; times the mass that moves; of bias()
  VectorXd q_, nu_, bias_, engine_bias_;
  Pose X_Bo_ = Pose::Identity();
  std::vector<Load> loads_;  // of the base, then by joint
  Load object_load_;
};

}  // namespace dexcheck
