#pragma once

// Errors of geometry, found from the base outward.

#include <functional>
#include <vector>

#include "harness/diagnosis/placement.h"
#include "harness/diagnosis/repair.h"

namespace dexcheck {

/// Explains misplaced axes, frames and bodies by changes of MDH rows, of the places where chains and frames
/// start, of the sign of an axis, or of two joints' order.
///
/// Always the misplaced link nearest the base is taken: what carries it is right, so what is wrong is its own
/// joint or one that moves nothing else that is compared. Each number there is solved for by itself, and the
/// one after whose repair the fewest things are misplaced is taken; then the walk goes on.
class GeometryWalk {
 public:
  /// @param evidence must outlive this. @param bodies as for Placement.
  /// @param force_error a measure of the forces' disagreement with a specification, which decides between
  /// repairs
  ///   that place everything alike; may be empty.
  GeometryWalk(const RobotSpec& spec, const EngineEvidence& evidence, bool bodies,
               std::function<double(const RobotSpec&)> force_error);

  /// Causes in the order found, each to be repaired after those before it.
  std::vector<Repair> Run();
  /// The specification with all of them repaired.
  [[nodiscard]] const RobotSpec& repaired() const { return spec_; }

 private:
  struct Candidate {
    Repair cause;
    double cost = 0.0;
  };
  [[nodiscard]] std::vector<int> ListFailing(const std::vector<int>& items) const;
  [[nodiscard]] int FindFirst(const std::vector<int>& failing) const;
  [[nodiscard]] bool FindCause(int first, Repair* cause);
  /// Gives up what fails on a link; when nearly all is suspect, what the link carries too.
  void Leave(int link, const std::vector<int>& failing);
  [[nodiscard]] std::vector<Parameter> ListSuspects(int link, const std::vector<int>& failing);
  /// Suspects among which pairs are tried: all, or when they are many, those of the link itself.
  [[nodiscard]] std::vector<Parameter> ListNear(int link, const std::vector<Parameter>& suspects) const;
  [[nodiscard]] bool KeepsWhatIsRight(const Parameter& parameter);
  [[nodiscard]] std::vector<std::vector<int>> ListTargets(int link, const std::vector<int>& failing) const;
  void TryParameters(int link, const std::vector<Parameter>& parameters,
                     const std::vector<std::vector<int>>& targets, std::vector<Candidate>* candidates);
  void TryStructure(int link, std::vector<Candidate>* candidates);
  bool Solve(const std::vector<Parameter>& parameters, const std::vector<int>& target,
             const std::vector<double>& start);
  bool Iterate(const std::vector<Parameter>& parameters, const std::vector<int>& target,
               const std::vector<double>& start);
  [[nodiscard]] VectorXd CollectResidual(const std::vector<int>& target) const;
  /// Of what stands on one link.
  [[nodiscard]] int CountWrongNumbers(int link) const;
  [[nodiscard]] double CalcCost(size_t changes) const;
  [[nodiscard]] double CalcCostAfter(const Repair& cause);

  RobotSpec spec_;
  Placement placement_;
  std::function<double(const RobotSpec&)> force_error_;
  std::vector<bool> left_;   // items that no geometry explains
  size_t num_suspects_ = 0;  // of the last FindCause
};

}  // namespace dexcheck
