#pragma once

// Terms that somebody answers at a state, each a whole: what the protocol of programs has.

#include <array>
#include <optional>

#include "harness/descriptions/dynamics_provider.h"

namespace dexcheck {

/// Terms at one state, in the analytic model's coordinates q', xi of size n. What is not answered is empty.
struct AnsweredTerms {
  MatrixXd M;                       ///< M_bar', n x n.
  VectorXd coriolis;                ///< C_bar' xi
  VectorXd gravity;                 ///< Part of F_bar' due to gravity.
  VectorXd bias;                    ///< Their sum, the forces at xi_dot = 0.
  VectorXd friction;                ///< Part of F_bar' due to viscous damping.
  std::optional<double> kinetic;    ///< J
  std::optional<double> potential;  ///< J, above any level that stays the same.

  [[nodiscard]] bool Has(Term term) const;
  /// Writes a term that it has.
  void Read(Term term, Eigen::Ref<MatrixXd> out) const;
  /// The forces, those that are empty too.
  [[nodiscard]] std::array<VectorXd*, 4> forces() { return {&coriolis, &gravity, &bias, &friction}; }
  /// Forms the bias of its parts where it is not answered.
  void AddBias() {
    if (bias.size() == 0 && coriolis.size() > 0 && gravity.size() > 0) bias = coriolis + gravity;
  }
};

/// A provider that answers all that it has at once.
class AnsweredProvider : public DynamicsProvider {
 public:
  /// @param sample number of the state, counted from 0. @param q q'.
  virtual AnsweredTerms Evaluate(long sample, const VectorXd& q, const VectorXd& xi) = 0;

  void SetState(const DynamicsState& state) override { answer_ = Evaluate(state.sample, state.q, state.xi); }
  [[nodiscard]] bool Has(Term term) const override { return answer_.Has(term); }
  void Read(Term term, Eigen::Ref<MatrixXd> out) override { answer_.Read(term, out); }
  [[nodiscard]] bool has_own_level() const override { return true; }

 private:
  AnsweredTerms answer_;
};

}  // namespace dexcheck
