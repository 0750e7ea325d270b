#pragma once

// Equations that are wrong on purpose, the one table of them: in a comparison of terms (formula_mutants.h)
// they stand in the place of the model's, in a run the controller goes by them at every step.

#include <string>
#include <variant>
#include <vector>

#include "controller/control/grasp_model.h"

namespace dexcheck {

/// Terms of a robot at a state, to be changed.
struct RobotEquations {
  const RobotModel& model;
  const VectorXd& q;
  const VectorXd& xi;
  MatrixXd& M;
  MatrixXd& C;
  VectorXd& gravity;
  VectorXd& friction;
};

// The change of an equation, by the object that it describes.

struct RobotChange {
  void (*make)(const RobotEquations&);
};
/// Rotations of links, or of frames.
struct RotationsTransposed {
  bool of_frames;
};
/// J of a frame, from the left, by the frame's pose.
struct JacobianChange {
  Matrix6d (*make)(const Pose&);
};
/// J_dot, or in a run J_B_dot.
struct JacobianRate {
  double factor;
};
/// Positions and rates of two joints on their way into the model.
struct JointsExchanged {
  int a, b;
};
struct EnergyChange {
  void (*make)(EnergyAndMomentum*);
};
struct ObjectPoseChange {
  void (*make)(const Vector6d& X_o, Pose*);
};
/// Changes the object's dynamics in X_o.
struct ObjectChange {
  void (*make)(ObjectTerms*);
};
/// Changes the object's dynamics in its body velocity.
struct ObjectBodyChange {
  void (*make)(ObjectBodyTerms*);
};
struct ContactFrameChange {
  ContactGeometry (*make)(const Surface& fingertip, const Surface& object, ContactCoordinates);
};
/// G_i by another transform of wrenches than Ad^-T of g_o_cf.
struct GraspMapChange {
  Matrix6d (*make)(const Pose&);
};
/// G_dot.
struct GraspMapRate {
  double factor;
};
/// Rows of J_B' of a contact, from J_f.
struct ContactJacobianChange {
  MatrixXd (*make)(const ContactGeometry&, const Matrix6Xd&);
};
/// kappa_dot of a contact, from V_co_cf^cf, by another equation than (40).
struct RollingChange {
  Vector5d (*make)(ContactGeometry, Vector6d);
};

using EquationChange =
    std::variant<RobotChange, RotationsTransposed, JacobianChange, JacobianRate, JointsExchanged,
                 EnergyChange, ObjectPoseChange, ObjectChange, ObjectBodyChange, ContactFrameChange,
                 GraspMapChange, GraspMapRate, ContactJacobianChange, RollingChange>;

/// A wrong equation.
struct EquationFault {
  std::string name;   ///< "Coriolis terms dropped".
  const char* term;   ///< The term that should differ; nullptr when only runs have the fault.
  const char* check;  ///< The check of a run that should fail; nullptr when only comparisons have the fault.
  EquationChange change;
  bool (*applies)(const RobotModel&) = nullptr;  ///< To which robots besides; nullptr for all.
};

/// All that apply to the model: those of the object and of contacts need an object and fingertips.
std::vector<EquationFault> ListEquationFaults(const RobotModel& model);

/// Changes the terms of a run after they were evaluated, through the references that the model shows: the
/// model itself is not const.
class FaultyTerms {
 public:
  /// @param model evaluated at `state`; both outlive this.
  FaultyTerms(GraspModel* model, const MeasuredState& state) : model_(*model), state_(state) {}

  /// Makes a fault that has a check, and what follows from it: the slip of each contact (45), (46).
  void Make(const EquationChange& change) const;

 private:
  template <typename T>
  static T& Open(const T& shown) {
    return const_cast<T&>(shown);
  }
  [[nodiscard]] const GraspTerms& grasp() const { return model_.grasp(); }
  [[nodiscard]] const ContactGeometry& geometry(int contact) const;

  void MakeOne(const RobotChange& change) const;
  void MakeOne(const JacobianRate& change) const { Open(grasp().J_B_dot()) *= change.factor; }
  void MakeOne(const GraspMapRate& change) const { Open(grasp().G_dot()) *= change.factor; }
  void MakeOne(const ObjectChange& change) const { change.make(&Open(grasp().coordinates())); }
  void MakeOne(const ObjectBodyChange& change) const { change.make(&Open(grasp().body())); }
  void MakeOne(const GraspMapChange& change) const;
  void MakeOne(const ContactJacobianChange& change) const;
  void MakeOne(const RollingChange& change) const;

  GraspModel& model_;
  const MeasuredState& state_;
};

}  // namespace dexcheck
