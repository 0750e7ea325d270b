#pragma once

// Whatever has the terms of a robot's dynamics at a state: an analytic model, the engine, a program,
// results in files.

#include <string>
#include <vector>

#include "controller/dynamics/model_terms.h"

namespace dexcheck {

/// The terms, in the order in which they are shown: what stands above explains what stands below. Each is a
/// matrix in the coordinates q', xi of one model, n = dim xi; what it is, and how it is compared, says the
/// table of terms (harness/comparison/term_table.h).
enum class Term {
  kJointAxis,        ///< 6 x velocities of joints: direction and a point of the axis, world.
  kLinkCom,          ///< 3 x links, world.
  kLinkInertia,      ///< 9 x links, about the centre of mass in world axes.
  kFramePose,        ///< 12 x frames of the model: rotation, origin, world.
  kJ,                ///< 6 x n of each frame compared, side by side: body Jacobian in the frame's own axes.
  kJDotXi,           ///< 6 x frames compared: acceleration of the origin at constant xi, in its own axes.
  kM,                ///< In unreduced coordinates.
  kMBar,             ///< n x n
  kCBarXi,           ///< n
  kCBar,             ///< n x n
  kCBarProduct,      ///< n: C_bar'(xi) w.
  kGravity,          ///< n
  kBias,             ///< n: C_bar' xi + gravity.
  kFriction,         ///< n
  kKineticEnergy,    ///< 1
  kPotentialEnergy,  ///< 1
  kLinearMomentum,   ///< 3
  kAngularMomentum,  ///< 3
  kContactFrame,     ///< 19 x contacts; of all that follow see ContactValues.
  kG,                ///< 18 x contacts
  kJB,               ///< 3 x n of each contact, side by side.
  kKappaDot,         ///< 6 x contacts
  kJBDotXi,          ///< 3 x contacts
  kGDotTV,           ///< 3 x contacts
  kObjectPose,       ///< 12; of all that follow see ObjectValues.
  kVBo,              ///< 6
  kMHat,             ///< 36
  kCHatV,            ///< 6
  kNo,               ///< 6
  kObjectKineticEnergy,
  kObjectPotentialEnergy,
  kMo,       ///< 36
  kCoXoDot,  ///< 6
  kTermCount
};
inline constexpr size_t kTermCount = static_cast<size_t>(Term::kTermCount);

/// A state at which terms are compared, in the coordinates of the comparison's model.
struct DynamicsState {
  long sample = 0;  ///< Its number, from 0.
  VectorXd q;       ///< q'
  VectorXd xi;
  VectorXd w;  ///< A second velocity, which shows the matrix C_bar' beyond its product with xi.
  Vector6d X_o = Vector6d::Zero();
  Vector6d X_o_dot = Vector6d::Zero();
};

/// One provider of terms.
class DynamicsProvider {
 public:
  DynamicsProvider() = default;
  virtual ~DynamicsProvider() = default;
  DynamicsProvider(const DynamicsProvider&) = delete;
  DynamicsProvider& operator=(const DynamicsProvider&) = delete;

  /// Its name in a report.
  [[nodiscard]] virtual const std::string& name() const = 0;
  /// Evaluates what the terms are made of.
  virtual void SetState(const DynamicsState& state) = 0;
  /// Returns whether it has this term at the state set. A term that one of two providers lacks is not
  /// compared.
  [[nodiscard]] virtual bool Has(Term term) const = 0;
  /// Writes a term that it has, in the order of Term, at the state set. `out` has the term's shape, and at
  /// first zeros: entries that are always zero need not be written.
  virtual void Read(Term term, Eigen::Ref<MatrixXd> out) = 0;
  /// Whether its terms are those of the robot whose coupled joints follow (T of CalcCouplingMap): entries of
  /// the base, then of the joints that are free.
  [[nodiscard]] virtual bool is_reduced() const { return false; }
  /// Whether a link has mass, by its joint; -1 the base.
  [[nodiscard]] virtual bool HasMass(int /*link*/) const { return true; }
  /// Whether its potential energy is above a level of its own.
  [[nodiscard]] virtual bool has_own_level() const { return false; }
};

/// Rotation and place of a pose.
using Matrix34d = Eigen::Matrix<double, 3, 4>;

/// The object's terms, in Sigma_o.
struct ObjectValues {
  Matrix34d pose = Matrix34d::Zero();  ///< World.
  Vector6d V_Bo = Vector6d::Zero();
  Matrix6d M_hat = Matrix6d::Zero();
  Vector6d C_hat_V = Vector6d::Zero();
  Vector6d N_o = Vector6d::Zero();
  double kinetic = 0.0;
  double potential = 0.0;
  Matrix6d M_o = Matrix6d::Zero();  ///< These two in coordinates X_o.
  Vector6d C_o_X_o_dot = Vector6d::Zero();
};

/// One contact's terms.
struct ContactValues {
  static constexpr int kOverlap = 6;   ///< Its place in `frame`.
  Eigen::Matrix<double, 19, 1> frame;  ///< Point, normal and overlap; Sigma_cf in Sigma_o (3 x 4).
  Eigen::Matrix<double, 6, 3> G;
  Matrix3Xd J_B;  ///< 3 x n
  Vector3d J_B_dot_xi;
  Vector3d G_dot_T_V;
  Vector6d relative_twist;  ///< Of the fingertip against the object in Sigma_cf, as kappa_dot has it.
};

/// A provider that has a whole mechanism: what analytic model and engine share.
class MechanismProvider : public DynamicsProvider {
 public:
  explicit MechanismProvider(std::string name) : name_(std::move(name)) {}
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] const ObjectValues& object() const { return object_; }
  [[nodiscard]] const std::vector<ContactValues>& contacts() const { return contacts_; }
  [[nodiscard]] std::vector<ContactValues>* mutable_contacts() { return &contacts_; }

 protected:
  /// Writes what stands in the members below.
  void ReadValues(Term term, Eigen::Ref<MatrixXd> out) const;
  /// Whether the members below have it.
  [[nodiscard]] bool HasValue(Term term) const;
  EnergyAndMomentum energy_;
  ObjectValues object_;
  std::vector<ContactValues> contacts_;  ///< Of the first frames compared, one for each.
  bool has_object_ = false;              ///< Terms of the object as a body.
  bool has_coordinates_ = false;         ///< Its terms in X_o, and its pose by X_o.

 private:
  std::string name_;
};

}  // namespace dexcheck
