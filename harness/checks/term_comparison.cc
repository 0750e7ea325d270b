#include "harness/checks/term_comparison.h"

#include <algorithm>
#include <utility>

namespace dexcheck {

TermComparison::TermComparison(const Adapter& adapter) : scales_(adapter.model()) {
  context_.adapter = &adapter;
  context_.scales = &scales_;
}

void TermComparison::SetFrames(std::span<const int> frames, bool contacts) {
  for (const int frame : frames) {
    const auto chain = static_cast<Eigen::Index>(context_.engine->chain(frame).size());
    context_.frames.push_back(frame);
    context_.jacobians.emplace_back();
    context_.columns.emplace_back(Matrix6Xd::Zero(6, chain));
    if (!contacts) continue;
    ContactSides& sides = context_.contacts.emplace_back();
    sides.frame = frame;
    sides.model.J_B.setZero(3, chain);
    sides.engine.J_B.setZero(3, chain);
  }
}

void TermComparison::EvaluateFrames() {
  for (size_t i = 0; i < context_.frames.size(); ++i)
    context_.engine->CalcFrameColumns(context_.frames[i], context_.columns[i]);
}

void TermComparison::Ask(Asker asker, std::span<const TermGroup> leave_out) {
  std::vector<const TermEntry*> entries;
  for (const TermEntry& entry : ListTerms()) {
    const bool left_out = std::find(leave_out.begin(), leave_out.end(), entry.group) != leave_out.end();
    if ((entry.askers & asker) != 0 && !left_out) entries.push_back(&entry);
  }
  // The terms point to their records.
  records_.resize(entries.size());
  for (size_t i = 0; i < entries.size(); ++i) {
    const TermEntry& entry = *entries[i];
    CheckRecord& record = records_[i];
    record.name = asker == kAskedByRun ? entry.name : entry.consistency_name;
    record.description = "model against engine at the same state, relative to the term's scale";
    record.bound = CalcBound(entry, model().max_depth());
    std::vector<ZeroPattern> zeros;
    if (entry.list_zeros != nullptr) zeros = entry.list_zeros(context_);
    std::vector<Item> items;
    std::vector<Location> where;
    for (const TermItem& item : entry.list(context_)) {
      items.push_back({item.index, static_cast<Eigen::Index>(where.size()),
                       static_cast<Eigen::Index>(item.where.size())});
      where.insert(where.end(), item.where.begin(), item.where.end());
    }
    AskedTerm& asked = terms_.emplace_back(
        AskedTerm{&entry, std::move(items), ComparedTerm(&record, std::move(where), std::move(zeros))});
    if (entry.weighed == Weighed::kOnce) Evaluate(entry.weigh, asked.items, &asked.term.weight);
  }
}

void TermComparison::Evaluate(Evaluator evaluate, const std::vector<Item>& items,
                              Eigen::ArrayXd* numbers) const {
  for (const Item& item : items) evaluate(context_, item.index, numbers->segment(item.begin, item.count));
}

void TermComparison::Compare(double when, bool contacts) {
  context_.when = when;
  for (size_t i = 0; i < terms_.size(); ++i) {
    auto& [entry, items, term] = terms_[i];
    if (IsOfContacts(i) && !contacts) continue;
    Evaluate(entry->model, items, &term.model);
    Evaluate(entry->engine, items, &term.engine);
    if (entry->weighed == Weighed::kAtEachState) Evaluate(entry->weigh, items, &term.weight);
    if (entry->check_zeros != nullptr) entry->check_zeros(context_, &term);
    const bool failed_before = records_[i].failed;
    term.Finish(when);
    if (!records_[i].failed || failed_before) continue;
    records_[i].part = Describe(records_[i].first_failure, model(), model().num_base_velocities());
  }
}

}  // namespace dexcheck
