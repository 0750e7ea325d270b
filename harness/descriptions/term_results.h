#pragma once

// Terms that a program computes at a state, each a whole: what the protocol of programs has.

#include <array>
#include <functional>
#include <optional>
#include <string>

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

/// Terms as functions of q' and xi, in the robot's own order of joints (of a floating base in MuJoCo's
/// convention). Those that are empty are not compared.
struct TermFunctions {
  std::string name = "functions";
  std::function<MatrixXd(const VectorXd& q)> M;                      ///< n x n, armature included.
  std::function<VectorXd(const VectorXd& q, const VectorXd& xi)> c;  ///< C xi
  std::function<VectorXd(const VectorXd& q)> g;                      ///< Forces that hold the robot still.
  std::function<VectorXd(const VectorXd& q, const VectorXd& xi)> h;  ///< c + g
  std::function<VectorXd(const VectorXd& q, const VectorXd& xi)> friction;  ///< Viscous.
};

/// The functions as a provider.
class FunctionProvider : public ResultProvider {
 public:
  FunctionProvider(TermFunctions functions, int size) : functions_(std::move(functions)), size_(size) {}
  [[nodiscard]] const std::string& name() const override { return functions_.name; }
  /// @throws InputError "NAME: TERM: must have n entries, got m".
  TermResults Evaluate(long sample, const VectorXd& q, const VectorXd& xi) override;

 private:
  void CheckSize(const char* term, Eigen::Index rows, Eigen::Index cols, Eigen::Index expected_cols) const;

  TermFunctions functions_;
  int size_;
};

}  // namespace dexcheck
