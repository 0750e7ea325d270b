#pragma once

// Terms of the table by two or more providers at the same states, each pair of providers compared.

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/comparison/term_table.h"
#include "harness/descriptions/random_states.h"

namespace dexcheck {

/// Two of the providers, and the records of their terms; a record's `model_value` is the first provider's.
struct ComparedPair {
  size_t first = 0;
  size_t second = 0;
  std::vector<CheckRecord> terms;
};

/// A number of the first pair that differs by more than the uncertainty of the other providers allows.
struct Excess {
  size_t term = 0;  ///< Its record's index.
  Location where;
  double units = 0.0;  ///< Difference relative to the uncertainty, the bound included.
  double first = 0.0, second = 0.0;
  double when = 0.0;
};

/// Numbers that differ by less than this fraction of the printed precision are one, printed in two forms.
inline constexpr double kOneNumber = 1e-3;

/// Keeps each term's numbers by each provider, and their records. Two providers are compared in all terms
/// that both have. Bounds and scales are those of the analytic model's terms (rounding_scales.h). If one
/// provider is reduced, all are: by T of CalcCouplingMap, at states in which the followers follow.
class TermComparison {
 public:
  /// @param model whose coordinates the providers have. All outlive this.
  /// @param frames whose Jacobians are compared. @param contacts how many of the first of them have contacts.
  TermComparison(const RobotModel& model, Asker asker, std::vector<DynamicsProvider*> providers,
                 std::vector<int> frames, size_t contacts = 0);
  /// Compares all frames of the model.
  TermComparison(const RobotModel& model, Asker asker, std::vector<DynamicsProvider*> providers);

  /// The first pair's robots once more, by other providers.
  struct Copy {
    DynamicsProvider* first;
    DynamicsProvider* second;
  };
  /// Copies of robots whose numbers are known to some digits: one with the nominal numbers, `draws` with one
  /// robot's numbers moved at random within their precision, and `others`, as good as the nominal one.
  struct Spread {
    Copy nominal;
    std::vector<Copy> draws;
    std::vector<Copy> others;
  };
  /// Makes the first pair's errors relative to U from now on, with bounds of 1. U = scale * bound + sum over
  /// the spreads of (the coverage of d - d_nominal over the draws + sum |d - d_nominal| over the others),
  /// with d = first - second of a copy. The coverage is the largest value over the draws where one number
  /// acts on the entry, and three times the root mean square elsewhere and for all terms that are no causes.
  /// @param causes terms from which the others follow.
  void CompareWithin(const std::vector<Spread>& spreads, std::span<const Term> causes);
  /// The worst entry of each place whose error is above 1; empty before CompareWithin.
  [[nodiscard]] const std::vector<Excess>& excesses() const { return excesses_; }
  /// The entry of the causes with the coarsest comparison among those that differ by more than rounding and
  /// kOneNumber and by no more than U: `units` is U relative to the term's scale. None where there is no such
  /// entry.
  [[nodiscard]] const std::optional<Excess>& loosest() const { return loosest_; }

  /// Everything that scales are formed from. Nothing else is known of the state.
  [[nodiscard]] ScaleContext& scales() { return scales_; }
  /// Sets the scales at `q`, `xi`, where `terms` are evaluated.
  void SetScales(const ModelTerms& terms, const Eigen::Ref<const VectorXd>& q,
                 const Eigen::Ref<const VectorXd>& xi);
  /// Compares at the state that the providers are set to. Nothing allocates except at the first state, and
  /// when a new worst case is stored.
  /// @param contacts whether the contacts' terms are among them.
  void Compare(double when, bool contacts = true);

  /// Whether a pair compares C_bar' by its product with a second velocity.
  [[nodiscard]] bool needs_second_velocity() const;
  /// Puts coupled joints where their leaders want them, when a provider is reduced.
  void Follow(DynamicsState* state) const;

  [[nodiscard]] const RobotModel& model() const { return *scales_.model; }
  [[nodiscard]] const std::vector<DynamicsProvider*>& providers() const { return providers_; }
  /// Records of the first two providers: one for each requested term that both may have, in order.
  [[nodiscard]] std::span<const CheckRecord> records() const { return pairs_.front().terms; }
  [[nodiscard]] std::span<CheckRecord> records() { return pairs_.front().terms; }
  [[nodiscard]] const TermEntry& entry(size_t record) const { return *terms_[record].entry; }
  /// Returns all pairs with the terms that were compared; (0, 1), (0, 2), ..., (1, 2), ...
  [[nodiscard]] std::vector<ComparedPair> TakePairs() const;
  /// Lists the requested terms that no pair has in common.
  [[nodiscard]] std::vector<std::string> ListNotCompared() const;

 private:
  struct AskedTerm {
    const TermEntry* entry;
    std::vector<MatrixXd> numbers;  ///< By provider,
    std::vector<bool> is_read;      ///< if it has the term at this state.
    MatrixXd scale, weight;         ///< 1 / scale
    long count = -1;                ///< Numbers compared; not known before the first state.
  };
  [[nodiscard]] bool Shares(const TermEntry& entry, size_t a, size_t b) const;
  void Read(AskedTerm* term, size_t provider);
  void Weigh(AskedTerm* term);
  [[nodiscard]] MatrixXd CalcDifference(AskedTerm* term, size_t copy) const;
  void WidenByDraws(AskedTerm* term) const;
  [[nodiscard]] bool IsCause(const AskedTerm& term) const;
  void NoteWithin(size_t term, Eigen::Index row, Eigen::Index col, const Excess& entry);
  void ComparePair(size_t term, double when, ComparedPair* pair);
  [[nodiscard]] Location Locate(const TermEntry& entry, Eigen::Index row, Eigen::Index col) const;

  /// Indices of providers.
  struct SpreadRange {
    size_t nominal, first_other, end;  ///< Two for each copy; draws stand behind the nominal one.
  };

  std::vector<DynamicsProvider*> providers_;
  std::vector<SpreadRange> spreads_;
  std::vector<Term> causes_;
  std::vector<Excess> excesses_;
  std::optional<Excess> loosest_;
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
