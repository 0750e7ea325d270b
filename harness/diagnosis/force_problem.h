#pragma once

// The residual of the balances in some of the steps, and its explanation.

#include <initializer_list>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "harness/diagnosis/causes.h"
#include "harness/diagnosis/force_points.h"
#include "harness/diagnosis/force_telling.h"
#include "harness/diagnosis/step_forces.h"

namespace dexcheck {

/// Noise where the checks of the balances hold, in their bounds.
inline constexpr double kFaint = 0.01;

/// One residual and what explains it.
class ForceProblem {
 public:
  /// Pushes that grow: from before these steps on, or from between any two of them.
  enum class Growth { kBefore, kWithin };
  /// @param level of the noise, in bounds of the checks.
  ForceProblem(const StepStore& store, StepForces* forces, const Segment& segment, double level = 1.0,
               Growth growth = Growth::kBefore);

  /// Whether the last explanation leaves no more than rounding.
  [[nodiscard]] bool is_exact() const { return is_exact_; }
  /// Whether the remainder is noise, or next to nothing beside what there was.
  [[nodiscard]] bool IsExplained(double fraction, double left) const;

  /// The terms of the last explanation with their sizes; forces at points by themselves.
  struct Terms {
    std::vector<CauseTerm> amplitudes;
    std::vector<ForceAtPoint> points;
    Eigen::Index count = 0;  ///< Of amplitudes.
  };
  [[nodiscard]] const Terms& terms() const { return terms_; }
  /// Faults that are there, as other steps have shown.
  void FixTerms(const Terms& known);

  /// Faults that do not change.
  bool ExplainConstant(const Segment& segment, Causes* causes);

  /// One force that changes in time, free at each step.
  void ExplainChanging(const Segment& segment, Causes* causes) const;

 private:
  /// Several faults of one joint may be anything that acts there. So may several of other places, where they
  /// leave more than rounding and a torque of one joint, free at each step, does not.
  bool ExplainJoint(const Segment& segment, const CauseSelection& selection, Causes* causes) const;
  /// A candidate whose amplitudes are free at each step.
  struct Free {
    size_t candidate = SIZE_MAX;
    double criterion = 0.0, largest = 0.0;
    VectorXd residual;
  };
  [[nodiscard]] Free FitFree(size_t index) const;
  /// All candidates of these faults, the most likely first.
  [[nodiscard]] std::vector<Free> FitAll(std::initializer_list<const char*> faults) const;
  /// A fault that is free at each step has no size, and is a class of all that may act there: a range that
  /// ends, a cable.
  [[nodiscard]] Explanation DescribeFree(const Segment& segment, const Free& free) const;
  /// Residual and candidates with the gravity that is known.
  void Build();
  /// Their noise becomes another.
  void SetLevel(const Vector2d& level);
  /// Subtracts the known terms from the residual, and adds forces at points that explain the rest.
  void Complete();
  /// Adds pushes that grow evenly: their growth a second, and their size when the run ends.
  void AddGrowing();
  /// Only those that were selected, from each time on. @returns whether there are any.
  bool NarrowGrowing(const CauseSelection& selection);
  /// One that begins between the step of the residual before this one and this one, or, where it stands for
  /// others, so many further away.
  [[nodiscard]] Candidate MakeGrowing(const Candidate& push, Eigen::Index first, Eigen::Index skipped) const;
  /// A joint that does not slide shows how much friction holds it, and not how much could.
  void NameStuckBearings();
  /// Root mean square of the robot's and the object's rows, without what the platform may leave.
  [[nodiscard]] Vector2d CalcSizes(const VectorXd& y) const;
  [[nodiscard]] bool LeavesRounding(const VectorXd& y) const;
  /// In units of the noise that there was at first.
  [[nodiscard]] double CalcLeft(const VectorXd& y) const;
  /// Bounds of checks hold for all robots; what an explanation leaves is how much noise there is in this one.
  [[nodiscard]] CauseSelection Select();
  /// Beside other faults a force acts elsewhere than by itself.
  bool RefinePoints(const CauseSelection& selection);
  /// Corrects columns of a centre of mass, whose effect grows with its square, too.
  bool RefineCenters(const CauseSelection& selection);
  [[nodiscard]] CauseSelection SelectOnce();
  [[nodiscard]] CauseSelection SelectRefined();
  /// Payloads, and centres of mass by which inertias change freely, stand for several plainer faults:
  /// without.
  [[nodiscard]] CauseSelection SelectPlain();
  /// Whether a payload or another centre of mass can be all that a term changes.
  [[nodiscard]] bool IsOneBody(const CauseTerm& term) const;

  const StepStore& store_;
  StepForces* forces_;
  Growth growth_;
  std::set<std::string> growing_;  // that are tried; empty for all
  bool is_faint_;                  // whether the checks of the balances hold
  bool is_exact_ = false;
  std::vector<Candidate> candidates_;
  VectorXd whole_y_, y_;            // without known faults, too
  size_t constant_ = 0;             // candidates that are none at points
  std::vector<Eigen::Index> used_;  // steps of the store
  Eigen::Index steps_ = 0;
  Terms known_, terms_;
  Vector2d first_level_, level_, least_level_;  // StepForces::SetLevel
  std::vector<StepNoise> noise_;                // of each step
  std::vector<Turns> turns_;                    // by the same index
};

}  // namespace dexcheck
