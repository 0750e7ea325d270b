#pragma once

// Somebody's own terms, as functions in the same program: compared as a program's results are.

#include <functional>
#include <string>

#include "harness/descriptions/term_results.h"

namespace dexcheck {

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
