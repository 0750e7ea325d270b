#pragma once

// Terms of the table by two or more providers at the same states, each pair of providers compared.

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/checks/term_table.h"
#include "harness/descriptions/random_states.h"
#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// Two of the providers, and the records of their terms; `model_value` of a record is that of the first.
struct ComparedPair {
  size_t first = 0;
  size_t second = 0;
  std::vector<CheckRecord> terms;
};

/// Keeps each term's numbers by each provider, and their records. Two providers are compared in all terms
/// that both have. Bounds and scales are those of the analytic model's terms (rounding_scales.h). If one
/// provider is reduced, all are: by T of CalcCouplingMap, at states in which the followers follow.
class TermComparison {
 public:
  /// @param model whose coordinates the providers have. All outlive this.
  /// @param frames whose Jacobians are compared. @param contacts how many of the first of them have contacts.
  TermComparison(const RobotModel& model, Asker asker, std::vector<DynamicsProvider*> providers,
                 std::vector<int> frames, size_t contacts = 0);
  /// Of all frames of the model.
  TermComparison(const RobotModel& model, Asker asker, std::vector<DynamicsProvider*> providers);

  /// What scales are formed of. Nothing else is known of the state.
  [[nodiscard]] ScaleContext& scales() { return scales_; }
  /// At `q`, `xi`, where `terms` are evaluated.
  void SetScales(const ModelTerms& terms, const Eigen::Ref<const VectorXd>& q,
                 const Eigen::Ref<const VectorXd>& xi);
  /// Compares at the state that the providers are set to. Nothing allocates but at the first state, and when
  /// a new worst case is stored.
  /// @param contacts whether the contacts' terms are among them.
  void Compare(double when, bool contacts = true);

  /// Whether a pair compares C_bar' by its product with a second velocity.
  [[nodiscard]] bool needs_second_velocity() const;
  /// Puts coupled joints where their leaders want them, when a provider is reduced.
  void Follow(DynamicsState* state) const;

  [[nodiscard]] const RobotModel& model() const { return *scales_.model; }
  [[nodiscard]] const std::vector<DynamicsProvider*>& providers() const { return providers_; }
  /// Of the first two: one for each term asked that both may have, in the table's order.
  [[nodiscard]] std::span<const CheckRecord> records() const { return pairs_.front().terms; }
  [[nodiscard]] std::span<CheckRecord> records() { return pairs_.front().terms; }
  [[nodiscard]] const TermEntry& entry(size_t record) const { return *terms_[record].entry; }
  /// All pairs with the terms of which numbers were compared; (0, 1), (0, 2), ..., (1, 2), ...
  [[nodiscard]] std::vector<ComparedPair> TakePairs() const;
  /// Terms asked that no pair has in common.
  [[nodiscard]] std::vector<std::string> ListNotCompared() const;

 private:
  struct AskedTerm {
    const TermEntry* entry;
    std::vector<MatrixXd> numbers;  ///< By provider,
    std::vector<bool> is_read;      ///< if it has the term at this state.
    MatrixXd scale, weight;         ///< 1 / scale
    long count = -1;                ///< Numbers compared; not known before the first state.
  };
  void FormCoupling();
  [[nodiscard]] bool Shares(const TermEntry& entry, size_t a, size_t b) const;
  void Read(AskedTerm* term, size_t provider);
  void Weigh(AskedTerm* term);
  void ComparePair(size_t term, double when, ComparedPair* pair);
  [[nodiscard]] Location Locate(const TermEntry& entry, Eigen::Index row, Eigen::Index col) const;

  std::vector<DynamicsProvider*> providers_;
  ScaleContext scales_;
  std::vector<AskedTerm> terms_;
  std::vector<ComparedPair> pairs_;
  bool is_reduced_ = false;
  MatrixXd T_;             // n x (n - followers), when a provider is reduced
  std::vector<int> free_;  // entry of xi that each column of T stands for
  MatrixXd whole_;         // scratch, before it is reduced
  bool has_own_level_ = false;
  std::vector<std::optional<double>> first_potential_;  // of each provider
};

/// Gives the state of each sample, whose number it holds; false when there are no more.
using StateFeed = std::function<bool(DynamicsState* state)>;

/// Random states over the model's ranges, always the same ones. The model outlives the feed.
/// @param second_velocity whether w is drawn. @param object whether X_o, X_o_dot are.
StateFeed FeedRandomStates(const RobotModel& model, long samples, const StateRange& range, std::uint64_t seed,
                           bool second_velocity = false, bool object = false);

/// Compares at all states, until `progress` says stop. @return how many states were compared.
long CompareAtStates(const StateFeed& feed, const std::function<bool(long)>& progress,
                     TermComparison* comparison);

}  // namespace dexcheck
