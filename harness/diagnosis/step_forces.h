#pragma once

// The residual of the balances at a step, and the columns of faults of size 1, both whitened.

#include <string>
#include <vector>

#include "controller/control/actuation.h"
#include "controller/dynamics/model_terms.h"
#include "controller/dynamics/tree_factor.h"
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
inline constexpr const char* kContact = "contact further along the normal by";
/// The ending of the name of a force, a moment or a torque that grows evenly in time.
inline constexpr const char* kGrows = " that grows by";
/// The ending of the name of one that is free at each step.
inline constexpr const char* kChanges = " that changes, up to";
}  // namespace force_fault

/// Noise of one step: of the robot's rows s^2 1 + U U^T, of the object's that of each. s is rounding, and U
/// has what a platform leaves that tilts and slips: the inertial forces of all links when it
/// accelerates in six ways, and torques of its wheels, each as large as the check's bound.
struct StepNoise {
  Vector2d bounds = Vector2d::Ones();  ///< s and the object's at level 1.
  MatrixXd uneven;                     ///< Orthonormal columns V of U = V diag(sizes) W^T.
  VectorXd sizes;

  /// Divides rows (n + 6 by any) by the noise at this level: by s and, in V, (1 + U U^T / s^2)^(1/2).
  void Divide(const Vector2d& level, Eigen::Ref<MatrixXd> rows) const;
  /// Rows that are divided by the noise at one level are by that at another.
  void ChangeLevel(const Vector2d& from, const Vector2d& to, Eigen::Ref<MatrixXd> rows) const;

 private:
  [[nodiscard]] Vector2d CalcNoise(const Vector2d& level) const;
  /// (1 + sizes^2 / s^2)^(1/2)
  [[nodiscard]] Eigen::ArrayXd CalcSpread(const Vector2d& level) const;
  void Scale(const Vector2d& by, const Eigen::ArrayXd& along, Eigen::Ref<MatrixXd> rows) const;
};

/// Residual and columns of one step, whitened: of the robot L^-T f, L^T L its inertia, divided by its noise.
class StepForces {
 public:
  explicit StepForces(const StepStore& store);

  [[nodiscard]] Eigen::Index rows() const { return n_ + 6; }
  [[nodiscard]] const RobotModel& model() const { return model_; }
  /// In which masses that differ fall, m/s^2; the model's at first. @returns whether it is another.
  bool SetGravity(const Vector3d& gravity);
  /// Noise of robot and object, times the bound of their checks: 1 at first.
  void SetLevel(const Vector2d& level) { level_ = level; }

  [[nodiscard]] const StepNoise& noise() const { return noise_; }

  void SetStep(Eigen::Index step);
  /// How far links were apart at the most, m: where loads may be.
  [[nodiscard]] double reach() const { return reach_; }
  /// Which way links and object are turned at that step.
  [[nodiscard]] Turns ListTurns() const;
  /// Whether the checks of the balances fail, or the remainder is more than noise.
  [[nodiscard]] bool Differs(const VectorXd& residual) const;
  [[nodiscard]] VectorXd CalcResidual() const;
  /// Adds this step's rows to each candidate: `begin` is the first of them.
  void AddColumns(Eigen::Index begin, Eigen::Index steps, std::vector<Candidate>* candidates);

 private:
  struct Link {
    Matrix6Xd J, J_dot;  // of its centre of mass, in its axes
    Pose X;
    const MassProperties* body;
  };

  /// Whitens robot's forces and object's wrenches (n + 6 by any).
  void Whiten(Eigen::Ref<MatrixXd> f_w) const;
  /// This step's rows of a candidate.
  [[nodiscard]] auto RowsOf(Candidate* candidate) const {
    return candidate->columns.middleRows(begin_, rows());
  }
  void CalcUneven();
  /// The next candidate of the list, made at the first step. @param scale plausible sizes.
  Candidate& Next(std::vector<Candidate>* candidates, const char* fault, const std::string& place,
                  const std::string& unit, double nominal, const VectorXd& scale);
  /// Plausible sizes of `count` amplitudes: that times the weight or mass of all.
  [[nodiscard]] VectorXd Weights(Eigen::Index count) const { return VectorXd::Constant(count, weight_); }
  [[nodiscard]] VectorXd Masses(Eigen::Index count) const { return VectorXd::Constant(count, mass_); }
  /// Plausible sizes of a centre of mass, and of the inertia about the old one.
  [[nodiscard]] VectorXd Moved() const;
  Candidate& AddForceAtPoint(std::vector<Candidate>* candidates, const std::string& place);
  void AddRobot(Candidate* candidate, const Eigen::Ref<const MatrixXd>& f) const;
  void AddObject(Candidate* candidate, const Matrix6Xd& w) const;
  void AddJoints(std::vector<Candidate>* candidates);
  /// @param R, V, V_dot of the centre of mass, in the body's axes. @param link null for the object.
  void AddBody(const std::string& place, const MassProperties& body, const Matrix3d& R, const Vector6d& V,
               const Vector6d& V_dot, const Link* link, std::vector<Candidate>* candidates);
  void AddLink(int link, std::vector<Candidate>* candidates);
  void AddObjectForces(std::vector<Candidate>* candidates);
  void AddGravity(std::vector<Candidate>* candidates);
  void AddWheels(std::vector<Candidate>* candidates);
  /// Adds contacts that are not where they are declared to be: n x f on object and finger.
  void AddContacts(std::vector<Candidate>* candidates);

  const StepStore& store_;
  RobotModel model_;  // with a frame at each link's centre of mass, after its own
  ModelTerms terms_;
  TreeFactor factor_;
  ActuationMap actuation_;
  Eigen::Index n_;
  int first_link_ = 0;
  std::vector<Link> links_;
  Eigen::Index step_ = 0, begin_ = 0, steps_ = 1;
  size_t next_ = 0;
  Vector2d level_ = Vector2d::Ones();
  StepNoise noise_;
  double arm_ = 1.0;                  // of the object's inertia, m
  double mass_ = 0.0, weight_ = 0.0;  // of all, kg and N
  double reach_ = 0.0;
  Vector3d gravity_;
};

}  // namespace dexcheck
