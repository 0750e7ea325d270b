#pragma once

// Equations of the model that are wrong on purpose in a run: the controller goes by them at every step.

#include <string>
#include <vector>

#include "controller/control/grasp_model.h"

namespace dexcheck {

/// Changes terms after they were evaluated; the only one that may.
class SpoiledTerms {
 public:
  /// @param model evaluated at `state`; both outlive this.
  SpoiledTerms(GraspModel* model, const MeasuredState& state);

  [[nodiscard]] const RobotModel& model() const { return robot_.model(); }
  [[nodiscard]] const MeasuredState& state() const { return state_; }
  [[nodiscard]] MatrixXd& M() const { return robot_.M_; }
  [[nodiscard]] MatrixXd& C() const { return robot_.C_; }
  [[nodiscard]] VectorXd& gravity() const { return robot_.gravity_; }
  [[nodiscard]] VectorXd& friction() const { return robot_.friction_; }

  [[nodiscard]] int num_contacts() const { return grasp_.num_contacts(); }
  [[nodiscard]] const ContactGeometry& geometry(int contact) const;
  [[nodiscard]] auto G(int contact) const { return grasp_.G_.middleCols<3>(3 * contact); }
  [[nodiscard]] auto G_dot(int contact) const { return grasp_.G_dot_.middleCols<3>(3 * contact); }
  [[nodiscard]] auto J_B(int contact) const { return grasp_.J_B_.middleRows<3>(3 * contact); }
  [[nodiscard]] auto J_B_dot(int contact) const { return grasp_.J_B_dot_.middleRows<3>(3 * contact); }
  [[nodiscard]] const Matrix6Xd& J_f(int contact) const { return grasp_.J_f(contact); }
  /// V_co_cf^cf of a contact.
  [[nodiscard]] Vector6d CalcTwist(int contact) const;
  /// kappa_dot of a contact is another, and the rates that are taken along it.
  void SetKappaDot(int contact, const Vector5d& kappa_dot) const;

  [[nodiscard]] ObjectBodyTerms& body() const { return grasp_.body_; }
  /// With X_o as coordinates alone.
  [[nodiscard]] ObjectTerms& coordinates() const { return grasp_.coordinates_; }

  /// What follows from the changed terms: the slip of each contact.
  void Finish() const;

 private:
  ModelTerms& robot_;
  GraspTerms& grasp_;
  const MeasuredState& state_;
};

/// One wrong equation.
struct EquationMistake {
  std::string name;   ///< "Coriolis terms dropped".
  std::string check;  ///< The check of the first question that should fail.
  void (*spoil)(const SpoiledTerms&) = nullptr;
};

/// All that apply to the robot, which holds an object. @param coordinates whether the object's terms are
/// those in X_o.
std::vector<EquationMistake> ListEquationMistakes(const RobotModel& model, bool coordinates);

}  // namespace dexcheck
