#pragma once

// Laws that are wrong on purpose: do the checks find them, and name the part?

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "controller/control/actuation.h"
#include "controller/control/controller.h"
#include "controller/control/grasp_controller.h"
#include "controller/control/pseudoinverse.h"
#include "harness/checks/law_inputs.h"
#include "harness/diagnosis/equation_faults.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// What else than a factor can be wrong in a law.
enum class LawFaultKind {
  kNone,
  kNotProjected,        ///< xi_dot_d has sigma' instead of N sigma'.
  kOtherWeight,         ///< The pseudoinverse of J_B' has the weight M_bar', or 1 where M_bar' is asked for.
  kGraspTransposed,     ///< G^T in the place of G^+.
  kCoriolisTransposed,  ///< C_bar'^T xi_c.
  kNoActuationMap,      ///< Forces on v sent as wheel torques, without E_bar'^-1.
  kWheelsExchanged,     ///< The torques of both wheels.
  kJointsExchanged,     ///< The torques of the last two joints that carry the object.
  kForceAxes,           ///< Tangential axes of each contact force exchanged.
  kLate,                ///< X_d of one time step before.
  kVelocityOfNow,       ///< X_d_dot at t instead of half a time step before.
  kOneGain,             ///< K_p of x alone, 1 % too large.
  kWideCone,            ///< F_N counts on 1.1 times the friction that is asked for.
  kLessPreload,         ///< F_N with half of f_min.
  kOtherBarrier,        ///< F_N with 1.1 times the weight of the barrier.
};

/// One fault.
struct LawFault {
  std::string name;        ///< "Coriolis forces C_bar' times 1.001".
  size_t part = SIZE_MAX;  ///< In ListLawParts; its name is what the evidence should say.
  double factor = 1.0;     ///< Of that part: 0 leaves it out.
  LawFaultKind kind = LawFaultKind::kNone;
  std::vector<Eigen::Index> entries = {};  ///< Of tau' that have it; empty for all.
};

/// Each part of the law a thousandth too large and left out, then gravity upside down and the other kinds,
/// those of wheels where there are any.
std::vector<LawFault> ListLawFaults(bool has_wheels);

/// The law (55) as controller/control computes it, once more with a place for each fault: from the
/// controller's own terms, by its vectors and its pseudoinverses, and not by the formulas that judge it.
/// Without a fault it sends the same torques. What F_N it takes for right it tells as a right law does.
/// The fault begins with the run: while everything comes to rest the law is right.
class FaultyLaw final : public Controller {
 public:
  /// @param setup of a scenario that is no task; outlives this.
  /// @param is_on whether the fault is there; empty for from Begin on.
  FaultyLaw(const Setup& setup, LawFault fault, std::function<bool()> is_on = {});
  /// The right law, from terms of which one equation is wrong.
  FaultyLaw(const Setup& setup, const EquationFault& fault, std::function<bool()> is_on = {})
      : FaultyLaw(setup, LawFault{}, std::move(is_on)) {
    change_ = fault.change;
  }

  void Follow(const Trajectory& motion) override;
  void Begin(double t, const Reading& reading) override;
  void Step(const Reading& reading, double t, Command* command) override;
  [[nodiscard]] const GraspModel& model() const override { return model_; }

 private:
  [[nodiscard]] bool Has(LawFaultKind kind) const { return is_wrong_ && fault_.kind == kind; }
  /// Of a part by its number in ListLawParts.
  [[nodiscard]] double factor(size_t part) const {
    return is_wrong_ && fault_.part == part ? fault_.factor : 1.0;
  }
  void CalcTorque(const MeasuredState& state, double t, Command* command);
  /// @param chooses whether F_N is chosen, and not that of before.
  void CalcTorque(const MeasuredState& state, double t, bool chooses, Command* command);
  [[nodiscard]] Vector6d CalcObjectAcceleration(const DesiredMotion& desired) const;
  void FactorJacobian();
  void SetMotion(const MeasuredState& state, const Vector6d& V_Bo_dot);
  void SolveForces(const Vector6d& V_Bo_dot, bool chooses);
  void SendTorques(Command* command);

  GraspControllerOptions options_;
  LawFault fault_;
  std::function<bool()> is_on_;
  std::optional<EquationChange> change_;
  GraspModel model_;
  ActuationMap actuation_;
  Pseudoinverse J_pinv_, G_pinv_;
  GraspForceProblem problem_;
  GraspForceSolver solver_;
  double time_step_;
  long hold_;
  long steps_until_due_ = 0;
  int exchanged_ = 0;  // entry of tau'
  const Trajectory* motion_ = nullptr;
  bool has_begun_ = false, is_wrong_ = false;
  VectorXd right_;  // n, torques without the fault
  Vector6d F_o_ = Vector6d::Zero();
  VectorXd xi_c_, xi_dot_d_, sigma_prime_, force_, work_;  // n
  VectorXd f_c_, F_N_, rates_;                             // 3N
};

}  // namespace dexcheck
