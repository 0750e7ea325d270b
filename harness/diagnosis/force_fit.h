#pragma once

// Errors of masses, centres of mass, inertias, armature, damping and gravity, solved for by what the forces
// disagree in: what these do not show stays unknown.

#include <utility>
#include <vector>

#include "harness/diagnosis/evidence.h"
#include "harness/diagnosis/file_terms.h"
#include "harness/diagnosis/repair.h"

namespace dexcheck {

class ForceFit {
 public:
  /// @param written has the right geometry. @param terms, evidence was taken with it; both outlive this.
  ForceFit(const RobotSpec& written, const FileTerms& terms, const EngineEvidence& evidence);

  /// Single numbers by the fraction of the disagreement that each explains by itself, the first few.
  [[nodiscard]] std::vector<std::pair<Repair, double>> Rank() const;
  /// The fewest causes, a single number before others; none when not all of the disagreement is explained.
  [[nodiscard]] std::vector<Repair> Run() const;

 private:
  using Numbers = std::vector<Parameter>;
  /// Numbers as solved for, when only those change that are listed.
  struct Solution {
    Numbers numbers;
    RobotSpec repaired;
    VectorXd residual;
  };
  [[nodiscard]] bool IsSolved(const VectorXd& residual) const;
  /// What each candidate does to the forces, by its scale.
  [[nodiscard]] MatrixXd CalcColumns(const RobotSpec& at, const Numbers& numbers) const;
  /// Of columns: the squared length that each takes from the residual.
  [[nodiscard]] std::vector<std::pair<double, size_t>> SortByGain() const;
  [[nodiscard]] Solution Solve(const Numbers& numbers) const;
  [[nodiscard]] std::vector<Solution> SolveSingly() const;
  [[nodiscard]] Solution Select() const;
  [[nodiscard]] Repair ToCause(const Solution& solution) const;

  const RobotSpec& spec_;
  const FileTerms& terms_;
  const EngineEvidence& evidence_;
  Numbers candidates_;
  VectorXd residual_;  // at spec_
  MatrixXd columns_;   // at spec_, of all candidates; empty when nothing differs
};

}  // namespace dexcheck
