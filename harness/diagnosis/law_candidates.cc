#include "harness/diagnosis/law_candidates.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "harness/diagnosis/search_limit.h"

namespace dexcheck {

using Eigen::Index;

namespace {

constexpr double kPlausible = 300.0;   // of factors, which are units mistaken at the most
constexpr double kMostReversed = 3.0;  // of factors of the other sign
constexpr double kWhole = 1e-3;        // that the amplitude of what is there as a whole may be off

/// Whether a size of a fault with one can be; empty for any.
std::function<bool(const VectorXd&)> FindCondition(const LawEntry& entry) {
  if (entry.is_whole) return [](const VectorXd& a) { return std::abs(a[0] - 1.0) < kWhole; };
  if (entry.is_positive) return [](const VectorXd& a) { return a[0] >= 0.0; };
  if (entry.nominal != 1.0 || !entry.unit.empty() || entry.change) return {};
  return [](const VectorXd& a) { return std::abs(a[0]) < kPlausible && 1.0 + a[0] > -kMostReversed; };
}

}  // namespace

LawCandidates::LawCandidates(const StepStore& store, const LawProblem& problem)
    : problem_(problem),
      places_(ListLawPlaces(store.setup())),
      entries_(ListLawEntries(store.setup(), store.law())) {
  std::vector<std::string> names;
  for (const SignalName& motor : store.motors())
    names.push_back("law of " + motor.place.substr(sizeof("motor ") - 1));
  std::ranges::move(ListTorqueEntries(store.setup().model(), names, problem.steps()),
                    std::back_inserter(entries_));
  y_ = problem.GetDifferences(problem.fitted());
  for (const LawEntry& entry : entries_)
    if (entry.force) AddLinear(entry);
  DropRepeated();
  AddFitted();
}

bool LawCandidates::CanBe(const LawTerm& term) {
  const auto condition = FindCondition(*term.entry);
  const double plausible = term.entry->plausible;
  return (!condition || condition(term.sizes)) &&
         (plausible == 0.0 || term.sizes.cwiseAbs().maxCoeff() < plausible);
}

size_t LawCandidates::Find(const LawTerm& term) {
  const auto is_it = [&](const LawTerm& one) {
    return one.IsLike(term) && (one.entry->force || one.sizes == term.sizes);
  };
  const auto found = std::ranges::find_if(terms_, is_it);
  if (found != terms_.end()) return static_cast<size_t>(found - terms_.begin());
  Add(term, problem_.CalcChanges({term}, problem_.fitted()));
  return terms_.size() - 1;
}

void LawCandidates::Add(const LawTerm& term, MatrixXd columns) {
  const LawEntry& entry = *term.entry;
  Candidate& one = candidates_.emplace_back();
  one.fault = entry.fault;
  one.place = term.place != nullptr ? term.place->name : entry.place;
  one.unit = entry.unit;
  one.nominal = entry.nominal;
  one.columns = std::move(columns);
  one.is_possible = FindCondition(entry);
  if (entry.change) {
    one.is_possible = [](const VectorXd& a) { return std::abs(a[0] - 1.0) < kWhole; };
    one.parameters = static_cast<int>(term.sizes.size()) - 1;
  } else if (entry.plausible > 0.0) {
    one.scale = VectorXd::Constant(one.columns.cols(), entry.plausible);
  } else if (one.is_possible && !entry.is_whole && !entry.is_positive) {
    one.scale = VectorXd::Constant(1, kPlausible);
  }
  terms_.push_back(term);
}

void LawCandidates::AddLinear(const LawEntry& entry) {
  std::vector<MatrixXd> forces;
  for (const size_t step : problem_.fitted())
    problem_.At(step, {}, [&](const LawAtStep& at) { forces.push_back(entry.force(at)); });
  const Index p = forces.front().cols();
  if (2 * p > y_.size()) return;  // it would explain anything
  const auto add = [&](const LawPlace* place) {
    Add({&entry, place, VectorXd::Ones(p)}, problem_.CalcColumns(place, problem_.fitted(), forces));
  };
  if (!entry.at_places) add(nullptr);
  for (const LawPlace& place : places_)
    if (entry.at_places) add(&place);
}

void LawCandidates::DropRepeated() {
  const auto repeats = [&](size_t i, size_t of) {
    const Candidate &a = candidates_[of], &b = candidates_[i];
    const unsigned parts = terms_[of].entry->parts, others = terms_[i].entry->parts;
    const bool is_sum = parts != 0 && (others & parts) == parts && a.place == b.place;
    // A force with a size of its own, such as friction, may be what is there.
    const bool is_factor = parts != 0 && others == 0 && b.columns.cols() == 1 && b.unit.empty();
    if (!is_sum && !is_factor) return false;
    constexpr double kSame = 1e-8;
    const auto column = a.columns.col(0), other = b.columns.col(0);
    const double square = column.squaredNorm(), product = column.dot(other);
    if (product * product < 0.5 * square * other.squaredNorm()) return false;  // saves time
    const VectorXd part = VectorXd::Constant(1, product / square);
    if (!((other - part[0] * column).norm() < kSame * other.norm())) return false;
    return is_sum || CanBe({terms_[of].entry, nullptr, part * (other.dot(y_) / other.squaredNorm())});
  };
  std::vector<size_t> kept;
  for (size_t i = 0; i < candidates_.size(); ++i) {
    if (!(candidates_[i].columns.squaredNorm() > 0.0)) continue;
    if (std::none_of(kept.begin(), kept.end(), [&](size_t of) { return repeats(i, of); })) kept.push_back(i);
  }
  for (size_t k = 0; k < kept.size(); ++k) {
    if (kept[k] == k) continue;
    candidates_[k] = std::move(candidates_[kept[k]]);
    terms_[k] = terms_[kept[k]];
  }
  candidates_.resize(kept.size());
  terms_.resize(kept.size());
}

void LawCandidates::AddFitted() {
  struct Try {
    std::vector<LawTerm> fault;
    double left;
  };
  std::vector<Try> tries;
  for (const LawEntry& entry : entries_)
    for (const VectorXd& start : entry.starts) tries.push_back({{{&entry, nullptr, start}}, 0.0});
  struct Round {
    size_t kept;
    int iterations;
    bool has_few_steps;
  };
  constexpr Round kRounds[] = {{60, 1, true}, {24, 5, true}, {12, 12, false}};
  for (const Round& round : kRounds) {
    for (Try& one : tries) {
      if (SearchLimit::IsOver()) return;
      one.left = problem_.Fit(round.has_few_steps ? problem_.few() : problem_.fitted(), round.iterations,
                              &one.fault);
    }
    std::ranges::sort(tries, {}, &Try::left);
    if (tries.size() > round.kept) tries.resize(round.kept);
  }
  for (const Try& one : tries)
    if (CanBe(one.fault.front())) Find(one.fault.front());
}

}  // namespace dexcheck
