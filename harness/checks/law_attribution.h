#pragma once

// Which part of the law is wrong: the difference of torques, explained by the law's own summands.

#include <string>
#include <vector>

#include "harness/checks/law_reference.h"

namespace dexcheck {

/// One summand, or several that are one thing, and the factor that it has in the torques.
struct LawFinding {
  std::string name;        ///< "Coriolis forces C_bar'".
  std::string symbol;      ///< "C_bar' xi_c".
  double factor = 1.0;     ///< 1 is right, 0 missing.
  double explained = 0.0;  ///< Fraction of the difference's square that it explains.
};

/// Regression of E_bar' (tau' - tau'_printed) = sum_i (factor_i - 1) part_i over the steps added.
class LawAttribution {
 public:
  LawAttribution();

  /// @param difference E_bar' (tau' - tau'_printed) (n). @param parts n x kLawPartCount. @param weight of
  /// this step, so that none drowns the others.
  void Add(const Eigen::Ref<const VectorXd>& difference, const Eigen::Ref<const MatrixXd>& parts,
           double weight);

  [[nodiscard]] bool has_any() const { return squares_ > 0.0; }
  /// The summand that explains the difference best by itself; of those that explain it equally well the
  /// first.
  [[nodiscard]] LawFinding FindOne() const;
  /// In words: "Coriolis forces C_bar' xi_c: 0.9 times what (55) has, explains 100 % of the torque
  /// difference".
  [[nodiscard]] std::string Tell() const;

 private:
  MatrixXd normal_;   // sum of parts^T parts
  VectorXd product_;  // sum of parts^T difference
  double squares_ = 0.0;
};

}  // namespace dexcheck
