#pragma once

// Equations that are wrong on purpose, each once: in a comparison of terms (formula_mutants.h) they stand in
// the place of the model's, in a run the controller goes by them at every step.

#include <functional>
#include <span>
#include <string>
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

/// A wrong equation of one form. @tparam Change a function that makes what is wrong.
template <typename Change>
struct WrongEquation {
  const char* name;   ///< "Coriolis terms dropped".
  const char* term;   ///< The term that should differ; nullptr when only runs have the fault.
  const char* check;  ///< The check of a run that should fail; nullptr when only comparisons have the fault.
  Change change;
  bool (*applies)(const RobotModel&) = nullptr;  ///< To which robots; nullptr for all.
};

using RobotEquation = WrongEquation<void (*)(const RobotEquations&)>;
/// G_i by another transform of wrenches than Ad^-T of g_o_cf.
using GraspMapEquation = WrongEquation<Matrix6d (*)(const Pose&)>;
/// Rows of J_B' of a contact, from J_f.
using ContactJacobianEquation = WrongEquation<MatrixXd (*)(const ContactGeometry&, const Matrix6Xd&)>;
/// kappa_dot of a contact, from V_co_cf^cf, by another equation than (40).
using RollingEquation = WrongEquation<Vector5d (*)(ContactGeometry, Vector6d)>;
/// Of the object's dynamics in X_o.
using ObjectEquation = WrongEquation<void (*)(ObjectTerms*)>;

/// Those of the robot's dynamics that have an effect on this robot.
std::vector<RobotEquation> ListRobotEquations(const RobotModel& model);
std::span<const GraspMapEquation> ListGraspMapEquations();
std::span<const ContactJacobianEquation> ListContactJacobianEquations();
std::span<const RollingEquation> ListRollingEquations();
std::span<const ObjectEquation> ListObjectEquations();

/// Changes terms after they were evaluated, through the references that the model shows: the model itself is
/// not const.
class FaultyTerms {
 public:
  /// @param model evaluated at `state`; both outlive this.
  FaultyTerms(GraspModel* model, const MeasuredState& state) : model_(*model), state_(state) {}

  [[nodiscard]] RobotEquations robot() const;
  [[nodiscard]] int num_contacts() const { return grasp().num_contacts(); }
  [[nodiscard]] const ContactGeometry& geometry(int contact) const;
  [[nodiscard]] auto G(int contact) const { return Open(grasp().G()).middleCols<3>(3 * contact); }
  [[nodiscard]] auto J_B(int contact) const { return Open(grasp().J_B()).middleRows<3>(3 * contact); }
  [[nodiscard]] Matrix6Xd& G_dot() const { return Open(grasp().G_dot()); }
  [[nodiscard]] MatrixXd& J_B_dot() const { return Open(grasp().J_B_dot()); }
  [[nodiscard]] const Matrix6Xd& J_f(int contact) const { return grasp().J_f(contact); }
  /// V_co_cf^cf of a contact.
  [[nodiscard]] Vector6d CalcTwist(int contact) const;
  /// kappa_dot of a contact is another, and the rates that are taken along it.
  void SetKappaDot(int contact, const Vector5d& kappa_dot) const;

  [[nodiscard]] ObjectBodyTerms& body() const { return Open(grasp().body()); }
  /// With X_o as coordinates alone.
  [[nodiscard]] ObjectTerms& coordinates() const { return Open(grasp().coordinates()); }

  /// What follows from the changed terms: the slip of each contact (45), (46).
  void Finish() const;

 private:
  template <typename T>
  static T& Open(const T& shown) {
    return const_cast<T&>(shown);
  }
  [[nodiscard]] const GraspTerms& grasp() const { return model_.grasp(); }

  GraspModel& model_;
  const MeasuredState& state_;
};

/// One wrong equation of a run.
struct EquationFault {
  std::string name;
  std::string check;
  std::function<void(const FaultyTerms&)> apply;
};

/// All that apply to the robot, which holds an object. @param coordinates whether the object's terms are
/// those in X_o.
std::vector<EquationFault> ListEquationFaults(const RobotModel& model, bool coordinates);

}  // namespace dexcheck
