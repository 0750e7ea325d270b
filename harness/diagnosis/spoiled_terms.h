#pragma once

// Equations of the model that are wrong on purpose in a run: the controller goes by them at every step.

#include <string>
#include <vector>

#include "controller/control/grasp_model.h"

namespace dexcheck {

/// Changes terms after they were evaluated, through the references that the model shows: the model itself is
/// not const.
class SpoiledTerms {
 public:
  /// @param model evaluated at `state`; both outlive this.
  SpoiledTerms(GraspModel* model, const MeasuredState& state) : model_(*model), state_(state) {}

  [[nodiscard]] const RobotModel& model() const { return model_.robot().model(); }
  [[nodiscard]] const MeasuredState& state() const { return state_; }
  [[nodiscard]] MatrixXd& M() const { return Open(model_.robot().M()); }
  [[nodiscard]] MatrixXd& C() const { return Open(model_.robot().C()); }
  [[nodiscard]] VectorXd& gravity() const { return Open(model_.robot().gravity()); }
  [[nodiscard]] VectorXd& friction() const { return Open(model_.robot().friction()); }

  [[nodiscard]] int num_contacts() const { return grasp().num_contacts(); }
  [[nodiscard]] const ContactGeometry& geometry(int contact) const;
  [[nodiscard]] auto G(int contact) const { return Open(grasp().G()).middleCols<3>(3 * contact); }
  [[nodiscard]] auto G_dot(int contact) const { return Open(grasp().G_dot()).middleCols<3>(3 * contact); }
  [[nodiscard]] auto J_B(int contact) const { return Open(grasp().J_B()).middleRows<3>(3 * contact); }
  [[nodiscard]] auto J_B_dot(int contact) const { return Open(grasp().J_B_dot()).middleRows<3>(3 * contact); }
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

/// One wrong equation.
struct EquationFault {
  std::string name;   ///< "Coriolis terms dropped".
  std::string check;  ///< The check of the first question that should fail.
  void (*spoil)(const SpoiledTerms&) = nullptr;
};

/// All that apply to the robot, which holds an object. @param coordinates whether the object's terms are
/// those in X_o.
std::vector<EquationFault> ListEquationFaults(const RobotModel& model, bool coordinates);

}  // namespace dexcheck
