#pragma once

// Terms of several sides at the same states, each pair of sides compared.

#include <functional>
#include <optional>
#include <vector>

#include "harness/checks/consistency.h"
#include "harness/descriptions/random_states.h"
#include "harness/descriptions/side_layout.h"

namespace dexcheck {

/// Two of the sides, and their terms' records; `model_value` of a record is that of the first.
struct ComparedPair {
  size_t first = 0;
  size_t second = 0;
  std::vector<CheckRecord> terms;  ///< Those that both have.
};

/// Compares what the sides answer: M_bar, C_bar_xi, gravity, bias (their sum), friction, kinetic and
/// potential energy. Bounds and scales are those of the analytic model's terms (rounding_scales.h). If one
/// side is reduced, all are: by T of CalcCouplingMap, at states in which the followers follow.
class SideComparison {
 public:
  /// @param robot whose coordinates the sides answer in. All outlive this.
  SideComparison(const RobotDescription& robot, std::vector<TermSide*> sides);

  /// @param q, xi what the sides were asked; see Follow.
  void Compare(const VectorXd& q, const VectorXd& xi, long sample);
  /// Puts coupled joints where their leaders want them, when a side is reduced.
  void Follow(VectorXd* q, VectorXd* xi) const;

  [[nodiscard]] const RobotModel& model() const { return model_; }
  /// All pairs that have terms in common; (0, 1), (0, 2), ..., (1, 2), ...
  [[nodiscard]] std::vector<ComparedPair> TakePairs() const;
  /// Terms that no pair has in common.
  [[nodiscard]] std::vector<std::string> ListUnanswered() const;

 private:
  enum Term { kMass, kCoriolis, kGravity, kBias, kFriction, kKinetic, kPotential, kTermCount };
  struct Pair {
    size_t first, second;
    std::vector<CheckRecord> records;  // by Term
  };

  /// Entry of the robot's xi that stands for an entry of the terms.
  [[nodiscard]] int CoordinateOf(Eigen::Index entry) const;
  void ReduceTerms(const TermSide& side, SideTerms* terms) const;
  void SetScales(const VectorXd& q, const VectorXd& xi);
  void ComparePair(const SideTerms& a, const SideTerms& b, double sample, Pair* pair);

  const RobotDescription& robot_;
  std::vector<TermSide*> sides_;
  RobotModel model_;
  ModelTerms terms_;
  RoundingScales scales_;
  int base_;
  bool is_reduced_ = false;
  MatrixXd T_;  // n x (n - followers); the identity when no side is reduced
  MatrixXd mass_scale_;
  VectorXd coriolis_scale_, gravity_scale_, friction_scale_;
  std::vector<std::optional<double>> first_potential_;  // of each side
  std::vector<Pair> pairs_;
};

/// States drawn as CheckConsistency draws them. The model outlives the feed.
StateFeed FeedRandomStates(const RobotModel& model, const ConsistencyOptions& options);

/// Compares all pairs at all states, until `progress` says stop. @return how many states were compared.
long CompareAtStates(const StateFeed& feed, const std::function<bool(long)>& progress,
                     SideComparison* comparison);

/// The convention of a floating base under which a side that disagrees would agree in all its terms.
/// @param reference what it is compared with. @param set makes the side speak a convention.
/// @param make_feed states to compare at; the first few are used.
std::optional<BaseConvention> FindOtherConvention(const RobotDescription& robot, TermSide* reference,
                                                  TermSide* side, const BaseConvention& spoken,
                                                  const std::function<void(const BaseConvention&)>& set,
                                                  const std::function<StateFeed()>& make_feed);

}  // namespace dexcheck
