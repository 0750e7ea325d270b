#pragma once

#include <algorithm>
#include <memory>
#include <span>
#include <vector>

#include "harness/checks/term_table.h"

namespace dexcheck {

/// Terms of the table, their numbers at one state after the other, and their records. The checks derive from
/// it: each fills the context with what its own model's side has, and sets the engine's state.
class TermComparison {
 public:
  /// One for each term asked, in the table's order.
  [[nodiscard]] std::span<const CheckRecord> records() const { return records_; }
  /// Every bound is at least this: what a scenario's tolerance asks for.
  void RaiseBounds(double least) {
    for (CheckRecord& record : records_) record.bound = std::max(record.bound, least);
  }
  /// Both sides' numbers at the last state.
  [[nodiscard]] const TermContext& context() const { return context_; }

 protected:
  explicit TermComparison(const Adapter& adapter);
  ~TermComparison() = default;
  TermComparison(const TermComparison&) = delete;
  TermComparison& operator=(const TermComparison&) = delete;

  /// Frames whose Jacobians are compared, and their contacts if they have any. The engine must be there.
  void SetFrames(std::span<const int> frames, bool contacts);
  /// By the engine, at the state set.
  void EvaluateFrames();
  /// Takes an asker's terms from the table; the frames must be set, and the links.
  /// @param leave_out groups that this asker has nothing to compare with.
  void Ask(Asker asker, std::span<const TermGroup> leave_out);
  /// Compares all terms at the state of the context. Nothing allocates but when a new worst case is stored.
  /// @param contacts whether the contacts' terms are among them.
  void Compare(double when, bool contacts);
  [[nodiscard]] bool IsOfContacts(size_t record) const {
    return terms_[record].entry->group == TermGroup::kContact;
  }
  [[nodiscard]] const RobotModel& model() const { return context_.adapter->model(); }

  TermContext context_;
  RoundingScales scales_;
  std::vector<CheckRecord> records_;

 private:
  struct Item {
    int index;
    Eigen::Index begin, count;  // among the term's numbers
  };
  struct AskedTerm {
    const TermEntry* entry;
    std::vector<Item> items;
    ComparedTerm term;
  };
  void Evaluate(Evaluator evaluate, const std::vector<Item>& items, Eigen::ArrayXd* numbers) const;

  std::vector<AskedTerm> terms_;
};

}  // namespace dexcheck
