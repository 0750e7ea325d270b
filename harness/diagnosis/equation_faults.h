#pragma once

// Equations that are wrong on purpose, the one table of them: in a comparison of terms (formula_mutants.h)
// they stand in the place of the model's, in a run the controller goes by them at every step.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "controller/control/grasp_terms.h"

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

/// The change of an equation: one of these.
struct EquationChange {
  void (*robot)(const RobotEquations&) = nullptr;
  bool transposes_links = false, transposes_frames = false;  ///< Their rotations.
  Matrix6d (*jacobian)(const Pose&) = nullptr;  ///< J of a frame, from the left, by the frame's pose.
  std::optional<double> jacobian_rate = {};     ///< Factor of J_dot, or in a run J_B_dot.
  /// Joints whose positions and rates are exchanged on their way into the model.
  std::optional<std::pair<int, int>> exchanged = {};
  void (*energy)(EnergyAndMomentum*) = nullptr;
  void (*object_pose)(const Vector6d& X_o, Pose*) = nullptr;
  void (*object)(ObjectTerms*) = nullptr;           ///< Dynamics in X_o.
  void (*object_body)(ObjectBodyTerms*) = nullptr;  ///< Dynamics in its body velocity.
  ContactGeometry (*contact_frame)(const Surface& fingertip, const Surface& object,
                                   ContactCoordinates) = nullptr;
  Matrix6d (*grasp_map)(const Pose&) =
      nullptr;                                ///< G_i by another transform of wrenches than Ad^-T of g_o_cf.
  std::optional<double> grasp_map_rate = {};  ///< Factor of G_dot.
  /// Rows of J_B' of a contact, from J_f.
  MatrixXd (*contact_jacobian)(const ContactGeometry&, const Matrix6Xd&) = nullptr;
  void (*rolling)(ContactGeometry*, Vector6d* V) = nullptr;  ///< By which (40) computes, V = V_co_cf^cf.

  [[nodiscard]] bool is_of_object() const { return object_pose || object || object_body; }
  [[nodiscard]] bool is_of_contact() const {
    return contact_frame || grasp_map || grasp_map_rate || contact_jacobian || rolling;
  }
};

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

/// Makes a fault that has a check, and what follows from it: the slip of each contact (45), (46). The terms
/// of a run are changed after they were evaluated, through the references that the model shows: the model
/// itself is not const.
/// @param model evaluated at `state`.
void MakeFault(const EquationChange& change, const MeasuredState& state, GraspModel* model);

}  // namespace dexcheck
