#pragma once

// The remainder of the equations of motion in some steps, and its explanation.

#include <initializer_list>
#include <set>
#include <string>
#include <vector>

#include "harness/diagnosis/causes.h"
#include "harness/diagnosis/force_points.h"
#include "harness/diagnosis/force_telling.h"
#include "harness/diagnosis/step_forces.h"

namespace dexcheck {

/// One residual and what explains it: faults that are there in all steps, or between any two jumps.
class ForceProblem {
 public:
  /// Pushes that grow: from before these steps on, or from between any two of them.
  enum class Growth { kBefore, kWithin };
  ForceProblem(const StepStore& store, StepForces* forces, const ForceSteps& steps,
               Growth growth = Growth::kBefore);

  /// Whether the last explanation leaves no more than rounding.
  [[nodiscard]] bool is_exact() const { return is_exact_; }
  /// Whether the remainder is noise, or next to nothing beside what there was.
  [[nodiscard]] static bool IsExplained(const CauseSelection& selection);

  /// Adds an explanation by faults that do not change, if there is one.
  bool ExplainConstant(Causes* causes);

  /// One force that changes in time, free at each step.
  void ExplainChanging(Causes* causes) const;

 private:
  /// Several faults of one joint may be anything that acts there; two that leave only rounding are these. So
  /// may several of other places, where they leave more than rounding and a torque of one joint, free at each
  /// step, does not.
  bool ExplainJoint(const CauseSelection& selection, Causes* causes) const;
  /// A candidate whose amplitudes are free at each step.
  struct Free {
    size_t candidate = SIZE_MAX;
    double criterion = 0.0, largest = 0.0;
    bool spans_rows = false;  ///< It explains any residual of the rows that it has.
    VectorXd residual;
  };
  [[nodiscard]] Free FitFree(size_t index) const;
  /// All candidates of these faults, the most likely first.
  [[nodiscard]] std::vector<Free> FitAll(std::initializer_list<const char*> faults) const;
  /// A fault that is free at each step has no size, and is a class of all that may act there: a range that
  /// ends, a cable.
  [[nodiscard]] Explanation DescribeFree(const Free& free) const;
  /// Residual and candidates with the gravity that is known.
  void Build();
  /// Adds candidates that act from one jump to another, those that explain best what both change.
  void AddProfiles();
  /// The candidates that explain best what changes at a jump.
  [[nodiscard]] std::vector<size_t> RankAt(size_t jump) const;
  /// Zeroes columns outside of the rows in which a candidate acts.
  [[nodiscard]] MatrixXd Mask(MatrixXd columns, const StepRange& within) const;
  /// The change of the residual at a jump, over its noise.
  [[nodiscard]] VectorXd CalcChange(size_t jump) const;
  /// Describes when a term acts.
  void SetTimes(const CauseTerm& term, Explanation* one) const;
  /// Adds pushes that grow evenly: their growth a second, and their size when the run ends.
  void AddGrowing();
  /// Only those that were selected, from each time on. @returns whether there are any.
  bool NarrowGrowing(const CauseSelection& selection);
  /// One that begins between the step of the residual before this one and this one, or, where it stands for
  /// others, so many further away.
  [[nodiscard]] Candidate MakeGrowing(const Candidate& push, Eigen::Index first, Eigen::Index skipped) const;
  /// A joint that does not slide shows how much friction holds it, and not how much could.
  void NameStuckBearings();
  /// Root mean square, in units of the noise.
  [[nodiscard]] static double CalcLeft(const VectorXd& y);
  [[nodiscard]] CauseSelection Select();
  /// Beside other faults a force acts elsewhere than by itself.
  bool RefinePoints(const CauseSelection& selection);
  /// Corrects columns of a centre of mass, whose effect grows with its square, too.
  bool RefineCenters(const CauseSelection& selection);
  [[nodiscard]] CauseSelection SelectRefined();
  /// Payloads, and centres of mass by which inertias change freely, stand for several plainer faults:
  /// without.
  [[nodiscard]] CauseSelection SelectPlain();
  /// Whether a payload or another centre of mass can be all that a term changes.
  [[nodiscard]] bool IsOneBody(const CauseTerm& term) const;

  const StepStore& store_;
  StepForces* forces_;
  const ForceSteps& steps_;
  Growth growth_;
  std::set<std::string> growing_;  // that are tried; empty for all
  bool is_exact_ = false;
  std::vector<Candidate> candidates_;
  std::vector<StepRange> within_;  // of each candidate
  VectorXd y_;
  size_t constant_ = 0;  // candidates that are there in all steps and do not grow
  Eigen::Index count_;
  std::vector<Turns> turns_;  // of each
};

}  // namespace dexcheck
