#pragma once

// The remainder of the equations of motion at a step (MotionBalance), and the columns of faults of size 1 in
// it, both by entry over its rounding.

#include <string>
#include <vector>

#include "controller/dynamics/model_terms.h"
#include "harness/diagnosis/cause_estimator.h"
#include "harness/diagnosis/force_points.h"
#include "harness/diagnosis/step_store.h"

namespace dexcheck {

/// Faults whose words differ from their candidates' names.
namespace force_fault {
inline constexpr const char* kBearing = "dry friction of the bearing";
inline constexpr const char* kStuckBearing = "dry friction of a bearing that sticks";
inline constexpr const char* kForce = "force at its centre of mass";
inline constexpr const char* kForceInAxes = "force at its centre of mass, in its axes";
/// A force of one direction in the world, and of one that turns with the body.
inline constexpr const char* kForceAtPoint = "force";
inline constexpr const char* kForceAtPointInAxes = "force, in its axes";
inline constexpr const char* kMomentInAxes = "moment, in its axes";
inline constexpr const char* kMassWithInertia = "mass and inertia";
inline constexpr const char* kCenter = "centre of mass off by";
/// A centre of mass whose effect on the inertia does not show.
inline constexpr const char* kCenterAlone = "centre of mass off by, alone";
inline constexpr const char* kGravity = "gravity off by";
/// Along itself.
inline constexpr const char* kGravitySize = "size of gravity off by";
inline constexpr const char* kWorld = "world";  // its place
/// The ending of the name of a force, a moment or a torque that grows evenly in time.
inline constexpr const char* kGrows = " that grows by";
/// The ending of the name of one that is free at each step.
inline constexpr const char* kChanges = " that changes, up to";
}  // namespace force_fault

/// Residual and columns of one step: the robot's entries, then the object's if there is one.
class StepForces {
 public:
  explicit StepForces(const StepStore& store);

  [[nodiscard]] Eigen::Index rows() const { return rows_; }
  [[nodiscard]] const RobotModel& model() const { return model_; }
  /// In which masses that differ fall, m/s^2; the model's at first. @returns whether it is another.
  bool SetGravity(const Vector3d& gravity);

  /// @param row of the store.
  void SetStep(const Eigen::Ref<const VectorXd>& row);
  /// A signal of that step.
  [[nodiscard]] auto Now(StepStore::Signal signal) const { return store_.Part(row_, signal); }
  /// The residual of that step over its rounding.
  [[nodiscard]] VectorXd CalcResidual() const { return Now(StepStore::kResidual).cwiseQuotient(noise_); }
  /// How far links were apart at the most, m: where loads may be.
  [[nodiscard]] double reach() const { return reach_; }
  /// Which way links and object are turned at that step.
  [[nodiscard]] Turns ListTurns() const;
  /// Row of StepStore::kDryFriction of one of the joints' velocities; -1 for a wheel's.
  [[nodiscard]] Eigen::Index FindDryFriction(int dof) const { return dof < wheels_ ? -1 : dry_ + dof; }
  /// Adds this step's rows to each candidate: `begin` is the first of them.
  void AddColumns(Eigen::Index begin, Eigen::Index steps, std::vector<Candidate>* candidates);

 private:
  struct Link {
    Matrix6Xd J, J_dot;  // of its centre of mass, in its axes
    Pose X;
    const MassProperties* body;
  };

  /// This step's rows of a candidate.
  [[nodiscard]] auto RowsOf(Candidate* candidate) const {
    return candidate->columns.middleRows(begin_, rows());
  }
  /// The next candidate of the list, made at the first step. @param scale plausible sizes.
  Candidate& Next(const char* fault, const std::string& place, const std::string& unit, double nominal,
                  const VectorXd& scale);
  /// Plausible sizes of `count` amplitudes: that times the weight or mass of all.
  [[nodiscard]] VectorXd Weights(Eigen::Index count) const { return VectorXd::Constant(count, weight_); }
  [[nodiscard]] VectorXd Masses(Eigen::Index count) const { return VectorXd::Constant(count, mass_); }
  void AddRobot(Candidate* candidate, const Eigen::Ref<const MatrixXd>& f) const;
  void AddObject(Candidate* candidate, const Matrix6Xd& w) const;
  void AddJoints();
  /// @param R, V, V_dot of the centre of mass, in the body's axes. @param link null for the object.
  void AddBody(const std::string& place, const MassProperties& body, const Matrix3d& R, const Vector6d& V,
               const Vector6d& V_dot, const Link* link);
  void AddObjectForces();
  void AddGravity();

  const StepStore& store_;
  RobotModel model_;  // with a frame at each link's centre of mass, after its own
  ModelTerms terms_;
  Eigen::Index n_, rows_;
  int first_link_ = 0, wheels_ = 0, dry_ = 0;
  std::vector<Link> links_;
  VectorXd row_;                                  // of the store
  std::vector<Candidate>* candidates_ = nullptr;  // that get columns
  Eigen::Index begin_ = 0, steps_ = 1;
  size_t next_ = 0;
  VectorXd noise_;                    // of each entry
  double mass_ = 0.0, weight_ = 0.0;  // of all, kg and N
  double reach_ = 0.0;
  Vector3d gravity_;
};

/// Times the noise of an entry, from which on a step differs.
inline constexpr double kFails = 10.0;

/// The steps of a store whose residual is explained at once: from the first that differs to the last.
struct ForceSteps {
  std::vector<Eigen::Index> all;     ///< Of the store.
  std::vector<VectorXd> rows;        ///< Rows of some of them and of those beside jumps, in time.
  std::vector<Eigen::Index> begins;  ///< Rows at which something jumps, each after that of the step before.
  std::vector<VectorXd> changes;     ///< Of the residual at each, StepStore::Jump.
};
/// Returns none where no step differs.
ForceSteps ListForceSteps(const StepStore& store);

}  // namespace dexcheck
