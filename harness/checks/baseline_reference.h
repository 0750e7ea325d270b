#pragma once

// The baseline laws (controller/control/baseline_law.h), computed a second time: with dense matrices,
// straight from the formulas, and from terms that another side evaluated. It shares no law's formulas with
// controller/control. The controller's terms C_bar', J_B_dot' and G_dot multiply only V_d - V_o here.

#include <Eigen/Cholesky>

#include "controller/common/types.h"
#include "controller/control/baseline_law.h"
#include "controller/control/trajectory.h"
#include "harness/checks/law_reference.h"

namespace dexcheck {

/// One of the baseline laws at one state. Nothing allocates after construction.
class BaselineReference {
 public:
  /// @throws std::invalid_argument for kComputedTorque.
  BaselineReference(ControlLaw law, const ObjectStiffness& stiffness, int num_velocities, int num_forces);

  /// @param plain with the same terms and motion evaluated: of it are J^+, sigma' and the demand of (55).
  /// @param G_dot (6 x k). @param F_N (k) internal force chosen by the law's optimisation.
  /// @returns false when M_bar' or Lambda_c is not regular.
  bool Evaluate(const LawSpec& spec, const LawReference& plain, const LawTerms& terms, const Matrix6Xd& G_dot,
                const DesiredMotion& desired, const Eigen::Ref<const VectorXd>& F_N);

  /// E_bar' tau' (n) and f_c (k).
  [[nodiscard]] const VectorXd& force() const { return force_; }
  [[nodiscard]] const VectorXd& f_c() const { return f_c_; }

 private:
  [[nodiscard]] bool CalcInertia(const LawTerms& terms);
  void CalcErrors(const LawSpec& spec, const LawTerms& terms, const DesiredMotion& desired);
  [[nodiscard]] Vector6d CalcWrench(const LawSpec& spec, const LawTerms& terms) const;

  ControlLaw law_;
  ObjectStiffness stiffness_;
  Eigen::LLT<MatrixXd> M_llt_, Lambda_c_llt_;
  MatrixXd M_inv_J_T_;                // n x k
  MatrixXd Lambda_c_inv_, Lambda_c_;  // k x k
  MatrixXd G_Lambda_c_;               // 6 x k
  Matrix6d Lambda_ = Matrix6d::Identity();
  Vector6d e_ = Vector6d::Zero(), V_e_ = Vector6d::Zero(), V_d_dot_ = Vector6d::Zero();
  VectorXd force_, motion_, xi_e_;  // n
  VectorXd f_c_, rates_;            // k
};

}  // namespace dexcheck
