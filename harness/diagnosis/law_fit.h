#pragma once

// Differences of a law's torques, and faults whose sizes are fitted to them together.

#include <vector>

#include "controller/dynamics/tree_factor.h"
#include "harness/diagnosis/law_entries.h"
#include "harness/diagnosis/step_store.h"

namespace dexcheck {

/// Steps at which the torques were not the law's, and what the explanation of their difference needs.
class LawProblem {
 public:
  using Index = Eigen::Index;
  using Steps = std::vector<size_t>;
  /// The store outlives this. @param noise by which differences of the right law are larger than rounding.
  LawProblem(const StepStore& store, double noise);

  [[nodiscard]] const std::vector<const LawSnapshot*>& steps() const { return steps_; }
  /// Whether the torques have the digits of single precision alone.
  [[nodiscard]] bool is_single() const { return is_single_; }
  /// Steps to which explanations are fitted; some of these; and those in which explanations have to hold.
  [[nodiscard]] const Steps& fitted() const { return fitted_; }
  [[nodiscard]] const Steps& few() const { return few_; }
  [[nodiscard]] const Steps& aside() const { return aside_; }

  /// Whitened differences of these steps (n steps).
  [[nodiscard]] VectorXd GetDifferences(const Steps& steps) const;
  /// A whitened force (n) of a step.
  [[nodiscard]] VectorXd Whiten(size_t step, VectorXd force) const;
  /// Whitened forces (n x p) of these steps, as far as a place has them; null for all.
  [[nodiscard]] MatrixXd CalcColumns(const LawPlace* place, const Steps& steps,
                                     const std::vector<MatrixXd>& forces) const;
  /// The law with these faults at a step, passed to `use`.
  template <typename Use>
  void At(size_t step, const std::vector<LawTerm>& faults, const Use& use) const {
    const LawAtStep& right = right_[step];
    std::vector<LawForce> laws = {law_};
    laws.reserve(1 + faults.size());
    for (const LawTerm& fault : faults)
      laws.push_back([&, &fault = fault, &before = laws.back()](const LawInputs& inputs) -> VectorXd {
        const bool is_right = &fault == faults.data() && &inputs == &right.inputs;
        if (is_right && right.force.size() > 0) return right.force + fault.CalcChange(actuation_, right);
        const LawAtStep at(right.step, inputs, before);
        if (at.force.size() == 0) return {};
        return at.force + fault.CalcChange(actuation_, at);
      });
    if (faults.empty()) return use(right);
    use(LawAtStep(right.step, right.inputs, laws.back()));
  }
  /// The whitened force that these faults together add to the right law (n steps).
  [[nodiscard]] VectorXd CalcChanges(const std::vector<LawTerm>& faults, const Steps& steps) const;
  /// The derivatives of that by the numbers (n steps x numbers). @param changes CalcChanges of these.
  [[nodiscard]] MatrixXd CalcSlopes(std::vector<LawTerm> faults, const Steps& steps,
                                    const VectorXd& changes) const;
  /// The sizes of a fault's columns: a vector's are of one size.
  [[nodiscard]] static VectorXd CalcScale(const LawTerm& fault, const MatrixXd& columns);
  /// The shortest sizes, in units of `scale`, of columns that leave least of y. @param independent part of a
  /// column beside others that counts.
  [[nodiscard]] static VectorXd Solve(const MatrixXd& columns, const VectorXd& scale, const VectorXd& y,
                                      double independent);
  /// Moves the numbers to where these faults leave least of the differences, by Gauss and Newton. @return the
  /// mean square of that.
  double Fit(const Steps& steps, int iterations, std::vector<LawTerm>* faults) const;

 private:
  void ChooseSteps(const std::vector<LawSnapshot>& all);
  void FindWeights(double noise);

  const RobotModel& model_;
  ActuationMap actuation_;
  LawForce law_;
  std::vector<TreeFactor> factors_;        // by step
  std::vector<LawAtStep> right_;           // by step
  std::vector<const LawSnapshot*> steps_;  // those that are fitted, then the others
  Steps fitted_, few_, aside_;
  bool is_single_ = false;
  VectorXd weights_;  // by step, one over the noise
};

}  // namespace dexcheck
