#pragma once

// Terms that a program computes at a state, each a whole: what the protocol of programs has.

#include <array>
#include <optional>

#include "harness/descriptions/dynamics_provider.h"

namespace dexcheck {

/// Terms at one state, in the analytic model's coordinates q', xi of size n. What is not provided is empty.
struct TermResults {
  MatrixXd M;                       ///< M_bar', n x n.
  VectorXd coriolis;                ///< C_bar' xi
  VectorXd gravity;                 ///< Part of F_bar' due to gravity.
  VectorXd bias;                    ///< Their sum, the forces at xi_dot = 0.
  VectorXd friction;                ///< Part of F_bar' due to viscous damping.
  std::optional<double> kinetic;    ///< J
  std::optional<double> potential;  ///< J, above any level that stays the same.

  [[nodiscard]] bool Has(Term term) const { return Find(term).size() > 0; }
  /// Writes a term that it has.
  void Read(Term term, Eigen::Ref<MatrixXd> out) const { out = Find(term); }
  /// The forces, those that are empty too.
  [[nodiscard]] std::array<VectorXd*, 4> forces() { return {&coriolis, &gravity, &bias, &friction}; }
  /// Forms the bias of its parts where it is not provided.
  void AddBias() {
    if (bias.size() == 0 && coriolis.size() > 0 && gravity.size() > 0) bias = coriolis + gravity;
  }

 private:
  [[nodiscard]] Eigen::Map<const MatrixXd> Find(Term term) const;
};

/// A provider that computes all that it has at once.
class ResultProvider : public DynamicsProvider {
 public:
  /// @param sample number of the state, counted from 0. @param q q'.
  virtual TermResults Evaluate(long sample, const VectorXd& q, const VectorXd& xi) = 0;

  void SetState(const DynamicsState& state) override { result_ = Evaluate(state.sample, state.q, state.xi); }
  [[nodiscard]] bool Has(Term term) const override { return result_.Has(term); }
  void Read(Term term, Eigen::Ref<MatrixXd> out) override { result_.Read(term, out); }
  [[nodiscard]] bool has_own_level() const override { return true; }

 private:
  TermResults result_;
};

}  // namespace dexcheck
