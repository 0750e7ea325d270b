#include "harness/comparison/term_comparison.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "controller/common/linear_algebra.h"
#include "harness/base/worst.h"
#include "harness/descriptions/robot_description.h"

namespace dexcheck {
namespace {

bool IsVelocity(TermParts parts) {
  return parts == TermParts::kVelocity || parts == TermParts::kVelocityPair;
}

/// Moves each joint's point to the foot of the perpendicular from the second's point: the position along an
/// axis is a choice of frames. A ball joint has one position.
void MoveAlongAxes(const RobotModel& model, const MatrixXd& second, MatrixXd* first) {
  for (Eigen::Index i = 0; i < first->cols(); ++i) {
    if (model.joint(model.joint_of_dof(static_cast<int>(i))).type == JointType::kBall) continue;
    const Vector3d axis = first->col(i).head<3>();
    const Vector3d point = first->col(i).tail<3>();
    first->col(i).tail<3>() = point + axis.dot(second.col(i).tail<3>() - point) * axis;
  }
}

}  // namespace

TermComparison::TermComparison(const RobotModel& model, Asker asker, std::vector<DynamicsProvider*> providers)
    : TermComparison(model, asker, std::move(providers), ListIndices(model.frames().size())) {}

TermComparison::TermComparison(const RobotModel& model, Asker asker, std::vector<DynamicsProvider*> providers,
                               std::vector<int> frames, size_t contacts)
    : providers_(std::move(providers)), scales_(model), first_potential_(providers_.size()) {
  scales_.contact_frames.assign(frames.begin(), frames.begin() + static_cast<std::ptrdiff_t>(contacts));
  scales_.contacts.resize(contacts);
  scales_.frames = std::move(frames);
  scales_.xi.setZero(model.num_velocities());
  for (int link = model.base().type == BaseType::kFixed ? 0 : -1; link < model.num_joints(); ++link) {
    scales_.has_mass.push_back(
        std::ranges::all_of(providers_, [&](const DynamicsProvider* one) { return one->HasMass(link); }));
  }
  for (const DynamicsProvider* const provider : providers_) {
    is_reduced_ = is_reduced_ || provider->is_reduced();
    has_own_level_ = has_own_level_ || provider->has_own_level();
  }
  if (is_reduced_) {
    T_ = CalcCouplingMap(model);
    free_ = ListFreeVelocities(model);
  }
  for (const TermEntry& entry : ListTerms()) {
    if ((entry.askers & asker) == 0) continue;
    // A program states the terms that it has only with its first result.
    bool is_shared = asker == kAskedOfPrograms;
    for (size_t b = 1; b < providers_.size(); ++b) is_shared = is_shared || Shares(entry, 0, b);
    if (!is_shared) continue;
    const auto [rows, cols] = CalcShape(entry, scales_);
    AskedTerm& term = terms_.emplace_back();
    term.entry = &entry;
    const bool is_velocity = is_reduced_ && IsVelocity(entry.parts);
    term.numbers.assign(providers_.size(), MatrixXd::Zero(is_velocity ? T_.cols() : rows,
                                                          is_velocity && cols > 1 ? T_.cols() : cols));
    term.is_read.assign(providers_.size(), false);
    term.scale.setOnes(rows, cols);
    term.weight = term.numbers[0];
  }
  for (size_t a = 0; a < providers_.size(); ++a) {
    for (size_t b = a + 1; b < providers_.size(); ++b) {
      ComparedPair& pair = pairs_.emplace_back(ComparedPair{a, b, {}});
      for (const AskedTerm& term : terms_) {
        CheckRecord& record = pair.terms.emplace_back();
        const TermEntry& entry = *term.entry;
        record.name =
            asker == kAskedByRun || entry.consistency_name == nullptr ? entry.name : entry.consistency_name;
        record.description = "model against engine at the same state, relative to the term's scale";
        record.bound = CalcBound(entry, model.max_depth());
      }
    }
  }
}

bool TermComparison::Shares(const TermEntry& entry, size_t a, size_t b) const {
  const auto both_have = [&](Term term) { return providers_[a]->Has(term) && providers_[b]->Has(term); };
  return both_have(entry.term) && (entry.instead_of == Term::kTermCount || !both_have(entry.instead_of));
}

void TermComparison::CompareWithin(const std::vector<Spread>& spreads, std::span<const Term> causes) {
  causes_.assign(causes.begin(), causes.end());
  const auto add = [&](const std::vector<Copy>& copies) {
    for (const Copy& copy : copies) providers_.insert(providers_.end(), {copy.first, copy.second});
    return providers_.size();
  };
  for (const Spread& spread : spreads) {
    const size_t nominal = providers_.size();
    add({spread.nominal});
    const size_t first_other = add(spread.draws);
    spreads_.push_back({nominal, first_other, add(spread.others)});
  }
  first_potential_.resize(providers_.size());
  pairs_.resize(1);
  for (AskedTerm& term : terms_) {
    term.numbers.resize(providers_.size(), term.numbers[0]);
    term.is_read.resize(providers_.size(), false);
  }
  for (CheckRecord& record : pairs_[0].terms) record.bound = 1.0;
}

bool TermComparison::needs_second_velocity() const {
  return std::ranges::any_of(terms_,
                             [](const AskedTerm& term) { return term.entry->term == Term::kCBarProduct; });
}

void TermComparison::Follow(DynamicsState* state) const {
  if (!is_reduced_) return;
  const int base = model().num_base_velocities();
  for (int i = 0; i < model().num_joints(); ++i) {
    const std::optional<JointCoupling>& coupling = model().joint(i).coupling;
    if (!coupling) continue;
    state->q[model().position_index(i)] =
        coupling->multiplier * state->q[model().position_index(coupling->leader)] + coupling->offset;
    state->xi[base + model().dof(i)] = coupling->multiplier * state->xi[base + model().dof(coupling->leader)];
  }
}

void TermComparison::SetScales(const ModelTerms& terms, const Eigen::Ref<const VectorXd>& q,
                               const Eigen::Ref<const VectorXd>& xi) {
  scales_.robot.SetState(terms, q, xi);
  scales_.xi = xi;
}

void TermComparison::Read(AskedTerm* term, size_t provider) {
  DynamicsProvider* const one = providers_[provider];
  term->is_read[provider] = one->Has(term->entry->term);
  if (!term->is_read[provider]) return;
  MatrixXd& numbers = term->numbers[provider];
  if (is_reduced_ && IsVelocity(term->entry->parts) && !one->is_reduced()) {
    // T is constant: T^T M T, and T^T of the forces.
    whole_.setZero(term->scale.rows(), term->scale.cols());
    one->Read(term->entry->term, whole_);
    numbers = T_.transpose() * whole_;
    if (whole_.cols() > 1) numbers = (numbers * T_).eval();
  } else {
    one->Read(term->entry->term, numbers);
  }
  if (term->entry->term != Term::kPotentialEnergy || !has_own_level_) return;
  // From the first state on: the level of zero is each provider's own.
  if (!first_potential_[provider]) first_potential_[provider] = numbers(0, 0);
  numbers(0, 0) -= *first_potential_[provider];
}

void TermComparison::Weigh(AskedTerm* term) {
  const TermEntry& entry = *term->entry;
  const bool is_first = term->count < 0;
  if (!is_first && (entry.is_scaled_once || entry.scale == nullptr)) return;
  scales_.first = &term->numbers[0];
  scales_.second = &term->numbers[1];
  if (entry.scale != nullptr) entry.scale(scales_, term->scale);
  if (is_reduced_ && IsVelocity(entry.parts)) {
    const MatrixXd T = T_.cwiseAbs();
    MatrixXd reduced = T.transpose() * term->scale;
    if (term->scale.cols() > 1) reduced = (reduced * T).eval();
    term->weight = reduced.cwiseInverse();
  } else {
    term->weight = term->scale.cwiseInverse();
  }
  if (entry.term == Term::kPotentialEnergy && has_own_level_) term->weight *= 0.5;
  if (is_first) term->count = (term->weight.array() != 0.0).count();
}

MatrixXd TermComparison::CalcDifference(AskedTerm* term, size_t copy) const {
  if (term->entry->term == Term::kJointAxis)
    MoveAlongAxes(model(), term->numbers[copy + 1], &term->numbers[copy]);
  return term->numbers[copy] - term->numbers[copy + 1];
}

bool TermComparison::IsCause(const AskedTerm& term) const { return Contains(causes_, term.entry->term); }

void TermComparison::WidenByDraws(AskedTerm* term) const {
  constexpr double kCoverage = 3.0;  // times the root mean square of draws at the ends of the intervals
  constexpr double kOne = 1.02;      // the largest draw over the root mean square; 1 where one number acts
  const bool is_cause = IsCause(*term);
  MatrixXd U = CalcBound(*term->entry, model().max_depth()) * term->scale;
  for (const SpreadRange& spread : spreads_) {
    const MatrixXd nominal = CalcDifference(term, spread.nominal);
    const size_t first_draw = spread.nominal + 2;
    MatrixXd squares = MatrixXd::Zero(nominal.rows(), nominal.cols());
    MatrixXd largest = squares;
    for (size_t i = first_draw; i < spread.first_other; i += 2) {
      const MatrixXd moved = (CalcDifference(term, i) - nominal).cwiseAbs();
      squares += moved.cwiseAbs2();
      largest = largest.cwiseMax(moved);
    }
    const MatrixXd rms = (squares * (2.0 / static_cast<double>(spread.first_other - first_draw))).cwiseSqrt();
    const MatrixXd wide = kCoverage * rms;
    U += is_cause ? MatrixXd((largest.array() <= kOne * rms.array()).select(largest, largest.cwiseMax(wide)))
                  : wide;
    for (size_t i = spread.first_other; i < spread.end; i += 2)
      U += (CalcDifference(term, i) - nominal).cwiseAbs();
  }
  term->weight = U.cwiseInverse();  // 0 of what is not compared, whose scale is infinite
}

void TermComparison::NoteWithin(size_t index, Eigen::Index row, Eigen::Index col, const Excess& entry) {
  if (spreads_.empty()) return;
  const AskedTerm& term = terms_[index];
  if (entry.units > 1.0) {
    auto known = std::ranges::find_if(
        excesses_, [&](const Excess& one) { return one.term == index && one.where == entry.where; });
    if (known == excesses_.end()) known = excesses_.insert(known, Excess{index, entry.where});
    if (entry.units > known->units) *known = entry;
  }
  const double rounding = CalcBound(*term.entry, model().max_depth());
  const bool is_within_rounding = std::abs(entry.first - entry.second) <= rounding * term.scale(row, col);
  if (!IsCause(term) || is_within_rounding || entry.units > 1.0 || entry.units < kOneNumber) return;
  const double open = 1.0 / (term.weight(row, col) * term.scale(row, col));
  if (loosest_ && open <= loosest_->units) return;
  loosest_ = entry;
  loosest_->units = open;
}

Location TermComparison::Locate(const TermEntry& entry, Eigen::Index row, Eigen::Index col) const {
  if (!is_reduced_ || !IsVelocity(entry.parts)) return FindLocation(entry, scales_, row, col);
  const int second = entry.parts == TermParts::kVelocity ? 0 : free_[static_cast<size_t>(col)];
  return FindLocation(entry, scales_, free_[static_cast<size_t>(row)], second);
}

void TermComparison::ComparePair(size_t index, double when, ComparedPair* pair) {
  AskedTerm& term = terms_[index];
  const TermEntry& entry = *term.entry;
  if (!term.is_read[pair->first] || !term.is_read[pair->second] || !Shares(entry, pair->first, pair->second))
    return;
  CheckRecord& record = pair->terms[index];
  MatrixXd& first = term.numbers[pair->first];
  const MatrixXd& second = term.numbers[pair->second];
  if (entry.term == Term::kJointAxis) MoveAlongAxes(model(), second, &first);
  double error = Largest((first - second).array().abs() * term.weight.array());
  if (!(error < std::numeric_limits<double>::infinity())) error = std::numeric_limits<double>::infinity();
  const bool failed_before = record.failed;
  const bool is_worst = error > record.worst || record.comparisons == 0 || !spreads_.empty();
  if (is_worst || (!(error <= record.bound) && !failed_before)) {
    for (Eigen::Index col = 0; col < first.cols(); ++col) {
      for (Eigen::Index row = 0; row < first.rows(); ++row) {
        const double weight = term.weight(row, col);
        if (weight == 0.0) continue;
        const double its_error = std::abs(first(row, col) - second(row, col)) * weight;
        const Location where = Locate(entry, row, col);
        record.CompareError(its_error, first(row, col), second(row, col), where, when);
        NoteWithin(index, row, col, {index, where, its_error, first(row, col), second(row, col), when});
      }
    }
  } else {
    record.comparisons += term.count;
  }
  record.AddStep(error);
  if (record.failed && !failed_before)
    record.part = Describe(record.first_failure, model(), model().num_base_velocities());
}

void TermComparison::Compare(double when, bool contacts) {
  for (size_t i = 0; i < terms_.size(); ++i) {
    AskedTerm& term = terms_[i];
    if (!contacts && IsOfContacts(*term.entry)) continue;
    for (size_t provider = 0; provider < providers_.size(); ++provider) Read(&term, provider);
    Weigh(&term);
    if (!spreads_.empty()) WidenByDraws(&term);
    for (ComparedPair& pair : pairs_) ComparePair(i, when, &pair);
  }
}

std::vector<ComparedPair> TermComparison::TakePairs() const {
  std::vector<ComparedPair> pairs = pairs_;
  for (ComparedPair& pair : pairs)
    std::erase_if(pair.terms, [](const CheckRecord& record) { return record.comparisons == 0; });
  return pairs;
}

std::vector<std::string> TermComparison::ListNotCompared() const {
  std::vector<std::string> names;
  for (size_t i = 0; i < terms_.size(); ++i) {
    if (std::ranges::all_of(pairs_, [&](const ComparedPair& pair) { return pair.terms[i].comparisons == 0; }))
      names.emplace_back(pairs_.front().terms[i].name);
  }
  return names;
}

StateFeed FeedRandomStates(const RobotModel& model, long samples, const StateRange& range, std::uint64_t seed,
                           bool second_velocity, bool object) {
  const auto source = std::make_shared<StateSource>(model, range, seed);
  return [=](DynamicsState* state) {
    if (state->sample >= samples) return false;
    source->DrawPositions(&state->q);
    source->DrawVelocity(&state->xi);
    if (second_velocity) source->DrawVelocity(&state->w);
    if (object) source->DrawObject(&state->X_o, &state->X_o_dot);
    return true;
  };
}

long CompareAtStates(const StateFeed& feed, const std::function<bool(long)>& progress,
                     TermComparison* comparison) {
  const RobotModel& model = comparison->model();
  ModelTerms terms(model);  // for scales alone
  ScaleContext& scales = comparison->scales();
  DynamicsState state;
  state.q.setZero(model.num_positions());
  state.xi.setZero(model.num_velocities());
  if (comparison->needs_second_velocity()) state.w = state.xi;
  bool go_on = true;
  while (go_on && feed(&state)) {
    comparison->Follow(&state);
    for (DynamicsProvider* const provider : comparison->providers()) provider->SetState(state);
    if (state.w.size() > 0) {
      terms.SetState(state.q, state.w);
      scales.robot_at_w.SetState(terms, state.q, state.w);
    }
    terms.SetState(state.q, state.xi);
    comparison->SetScales(terms, state.q, state.xi);
    if (model.object()) {
      const double rate = Worst(state.X_o_dot.head<3>().norm(), state.X_o_dot.tail<3>().cwiseAbs().sum());
      scales.object =
          CalcObjectScales(model.object()->body, model.gravity(), state.X_o.head<3>().norm(), rate);
    }
    comparison->Compare(static_cast<double>(state.sample));
    go_on = progress(++state.sample);
  }
  return state.sample;
}

}  // namespace dexcheck
