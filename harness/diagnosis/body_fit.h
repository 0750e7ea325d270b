#pragma once

// Errors of masses, centres of mass, inertias, armature, damping and gravity, solved for by linear
// regression.

#include <utility>
#include <vector>

#include "harness/diagnosis/evidence.h"
#include "harness/diagnosis/repair.h"

namespace dexcheck {

/// Constants added to inertias, armatures and dampings, so that a trial is a possible robot even while it is
/// solved for. The residuals are linear in them, so what the pads do can be taken off again.
struct BodyPads {
  std::vector<double> inertia;   ///< Base first; to all three moments, kg m^2.
  std::vector<double> armature;  ///< By joint.
  std::vector<double> damping;   ///< By joint.
};

/// Explains what the forces disagree in by the numbers that they are linear in (centres of mass: quadratic,
/// solved by iteration). A single number that explains all is taken before two, two before a vector, a vector
/// before many.
class BodyFit {
 public:
  /// By forces alone: what they do not show stays unknown.
  /// @param spec has the right geometry. @param evidence was taken with it and must outlive this.
  BodyFit(const RobotSpec& spec, const EngineEvidence& evidence);

  /// Causes, the one that explains most first; none when not all of the disagreement is explained.
  std::vector<Repair> Run();
  /// Only the ranking.
  void Rank();
  /// Single numbers by the fraction of the disagreement that each explains by itself, the first few, before
  /// any repair.
  [[nodiscard]] const std::vector<std::pair<Repair, double>>& ranking() const { return ranking_; }

 private:
  struct Solution {
    std::vector<Parameter> parameters;
    RobotSpec repaired;
    double worst = 0.0;  ///< Largest entry of the residual that is left.
    double squared = 0.0;
  };
  void MakePads();
  [[nodiscard]] VectorXd CalcResidual(const RobotSpec& spec) const;
  [[nodiscard]] MatrixXd CalcColumns(const RobotSpec& spec, const std::vector<Parameter>& parameters) const;
  [[nodiscard]] Solution Solve(const std::vector<Parameter>& parameters) const;
  [[nodiscard]] std::vector<Parameter> ListCandidates() const;
  /// The residual and what each candidate does to it; false when there is nothing to explain.
  bool Linearise();
  /// Squared length that each column takes from a residual, after the part along `first` has been taken.
  [[nodiscard]] VectorXd CalcGains(const VectorXd& residual, const VectorXd* first) const;
  [[nodiscard]] bool FindSolution(std::vector<Solution>* solutions);
  [[nodiscard]] Solution Grow() const;
  /// Takes numbers from a solution that it leaves as they were.
  void DropUnchanged(Solution* solution) const;
  /// Makes one cause of a mass and an inertia that grow alike: a solid of another mass.
  void MergeScaledBodies(std::vector<Repair>* causes) const;
  /// A number of a solution, to the digits that are solved for.
  [[nodiscard]] double Read(const Solution& solution, const Parameter& parameter) const;
  [[nodiscard]] Repair ToCause(const Solution& solution) const;

  RobotSpec spec_;
  const EngineEvidence* evidence_;
  VectorXd target_;
  BodyPads pads_;
  VectorXd pad_rows_;
  std::vector<Parameter> candidates_;
  MatrixXd columns_;  // at spec_, of all candidates
  VectorXd residual_;
  std::vector<std::pair<Repair, double>> ranking_;
};

}  // namespace dexcheck
