#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "controller/common/linear_algebra.h"
#include "controller/common/text.h"
#include "harness/checks/check_table.h"
#include "harness/diagnosis/law_search.h"
#include "harness/diagnosis/run_causes.h"
#include "harness/diagnosis/telling.h"

namespace dexcheck {
namespace {

using Eigen::Index;

constexpr double kZero =
    1e-6;  // a value nearer to zero than this part of the right one is that of what is missing

/// Factors of parts of the law, of which several may act on one torque: all torques' and one joint's, that of
/// a sum and that of one of its summands.
class LawFactors {
 public:
  LawFactors(std::span<const LawPartName> names, const LawCandidates& all)
      : names_(names), terms_(all.terms()), candidates_(all.candidates()) {}

  /// A factor that several have in common is no alternative to one of them.
  void DropAlternatives(CauseSelection* selection) const {
    for (CauseTerm& term : selection->terms) {
      std::erase_if(term.same, [&](const auto& same) {
        return std::ranges::any_of(selection->terms, [&](const CauseTerm& other) {
          return &other != &term &&
                 (Holds(other.candidate, same.first) || Holds(same.first, other.candidate));
        });
      });
    }
  }

  /// The candidate's whole factor, and what it is of: what others of the selection have of it apart is
  /// theirs. @param is_sum whether their effects are added, and not those of one on what the other leaves.
  void MakeWhole(const Candidate& one, const CauseSelection& selection, bool is_sum, Fault* fault) const {
    const auto index = static_cast<size_t>(&one - candidates_.data());
    unsigned rest = GetParts(index);
    std::string joints;
    for (const CauseTerm& term : selection.terms) {
      const size_t other = term.candidate;
      if (other == index) continue;
      if (Holds(other, index)) fault->value += (is_sum ? 1.0 : fault->value) * term.amplitude[0];
      if (!Holds(index, other)) continue;
      const Candidate& apart = candidates_[other];
      if (apart.place == one.place) {
        rest &= ~GetParts(other);
      } else if (GetParts(other) == GetParts(index)) {
        joints += (joints.empty() ? "" : ", ") + apart.place.substr(kOf.size());
      } else {
        fault->detail += (fault->detail.empty() ? "but for " : ", ") + apart.place + ": " + apart.fault;
      }
    }
    if (!joints.empty()) fault->place += " of all but " + joints;
    const auto name = std::ranges::find(names_, rest, &LawPartName::parts);
    if (rest != GetParts(index) && name != names_.end()) fault->fault = NameFactor(*name);
    if (std::abs(fault->value) < kZero) fault->value = 0.0;
  }

  static std::string NameFactor(const LawPartName& name) {
    return std::string(name.name) + " (" + name.symbol + "), factor";
  }

 private:
  static constexpr std::string_view kAll = "law", kOf = "law of ";
  [[nodiscard]] unsigned GetParts(size_t candidate) const { return terms_[candidate].entry->parts; }
  /// Whether one factor acts on all that the other one acts on.
  [[nodiscard]] bool Holds(size_t one, size_t other) const {
    const bool is_there =
        candidates_[one].place == candidates_[other].place || candidates_[one].place == kAll;
    return one != other && is_there && GetParts(other) != 0 &&
           (GetParts(other) & GetParts(one)) == GetParts(other);
  }

  std::span<const LawPartName> names_;
  std::span<const LawTerm> terms_;
  std::span<const Candidate> candidates_;
};

/// A fault of several numbers without a unit has no size, and neither has one that is there as a whole.
Fault DescribeLaw(const Candidate& one, const LawTerm& term, const VectorXd& error) {
  const LawEntry& entry = *term.entry;
  Fault fault = DescribeNumber(one, term.sizes, entry.force && !entry.is_whole ? error : VectorXd());
  if (entry.shape_unit != nullptr) {
    fault.fault += " " + FormatNumber(term.sizes.tail<1>()[0], 6) + " " + entry.shape_unit;
  } else if (entry.is_vector) {
    constexpr int kDigits = 4;
    constexpr double kRounding = 1e-6;  // of the length
    fault.value = term.sizes.norm();
    fault.error = 0.0;
    fault.detail =
        FormatVector((term.sizes.array().abs() < kRounding * fault.value).select(0.0, term.sizes), kDigits);
  } else if (one.unit.empty() && (entry.is_whole || term.sizes.size() > 1)) {
    fault.value = kNaN;
  } else if (std::abs(fault.value) < kZero * std::abs(one.nominal)) {
    fault.value = 0.0;
  }
  return fault;
}

/// Causes of a law's differences, and whether they explain all but noise.
struct FoundCauses {
  Causes causes;
  bool holds = false;
};

/// A search's explanation as a selection of candidates.
CauseSelection MakeSelection(const LawProblem& problem, const LawExplanation& found, LawCandidates* all) {
  const VectorXd y = problem.GetDifferences(problem.fitted());
  const MatrixXd slopes =
      problem.CalcSlopes(found.terms, problem.fitted(), problem.CalcChanges(found.terms, problem.fitted()));
  const VectorXd errors = CalcPseudoinverse(slopes.transpose() * slopes).diagonal().cwiseMax(0.0).cwiseSqrt();
  const auto size = [](const LawTerm& term) {
    return term.entry->force ? term.sizes : VectorXd(VectorXd::Ones(1));
  };
  CauseSelection selection;
  selection.left = std::sqrt(found.left);
  selection.fraction = 1.0 - found.left * static_cast<double>(y.size()) / y.squaredNorm();
  Index first = 0;
  for (size_t i = 0; i < found.terms.size(); ++i) {
    const LawTerm& one = found.terms[i];
    CauseTerm& term = selection.terms.emplace_back();
    term.candidate = all->Find(one);
    term.amplitude = size(one);
    term.error = errors.segment(first, one.CountNumbers());
    first += one.CountNumbers();
    std::vector<LawTerm> others = found.terms;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    term.fraction = (y - problem.CalcChanges(others, problem.fitted())).squaredNorm() / y.squaredNorm();
    for (const LawTerm& same : found.same[i]) term.same.emplace_back(all->Find(same), size(same));
  }
  std::ranges::sort(selection.terms, std::greater<>(), &CauseTerm::fraction);
  return selection;
}

FoundCauses ExplainLaw(const StepStore& store, const Explanation& start, double noise) {
  const LawProblem problem(store, noise);
  const VectorXd y = problem.GetDifferences(problem.fitted());
  LawCandidates all(store, problem);
  const auto get_term = [&](size_t candidate, const VectorXd& amplitude) {
    LawTerm term = all.terms()[candidate];
    if (term.entry->force) term.sizes = amplitude;
    return term;
  };
  CauseSelection selection = SelectCauses(y, all.candidates(), {.most_terms = 4, .restarts = 0});
  VectorXd left = problem.GetDifferences(problem.aside());
  LawExplanation sum;
  for (const CauseTerm& term : selection.terms) {
    sum.terms.push_back(get_term(term.candidate, term.amplitude));
    left -= problem.CalcChanges({sum.terms.back()}, problem.aside());
  }
  // Many faults would make what is little more than noise.
  constexpr double kMuch = 10.0;
  const bool shows = noise == 1.0 || y.squaredNorm() > kMuch * kMuch * static_cast<double>(y.size());
  FoundCauses result;
  result.holds = shows && IsExplained(problem, sum.terms, selection.left * selection.left, left) &&
                 (!sum.terms.empty() || problem.is_single());
  bool is_sum = true;
  if (shows && (!result.holds || sum.terms.size() > 1)) {
    const Index cost = result.holds ? sum.CalcCost() : std::numeric_limits<Index>::max();
    const LawExplanation found = FindLawFaults(problem, all, cost);
    is_sum = found.terms.empty();
    if (!is_sum) selection = MakeSelection(problem, found, &all);
    result.holds = result.holds || !is_sum;
  }
  const LawFactors factors(store.law()->ListParts(), all);
  factors.DropAlternatives(&selection);
  result.causes =
      DescribeSelection(start, selection, all.candidates(),
                        [&](const Candidate& one, const VectorXd& amplitude, const VectorXd& error) {
                          const auto index = static_cast<size_t>(&one - all.candidates().data());
                          Fault fault = DescribeLaw(one, get_term(index, amplitude), error);
                          if (one.nominal == 1.0 && one.unit.empty())
                            factors.MakeWhole(one, selection, is_sum, &fault);
                          return fault;
                        });
  if (problem.is_single()) {
    result.causes.push_back(start);
    result.causes.back().faults = {{"torques of single precision", "law", kNaN, 0.0, "", ""}};
  }
  if (result.holds) return result;
  // The nearest stands for all.
  result.causes.resize(1, start);
  Explanation& one = result.causes.front();
  one.outcome = CauseOutcome::kNotExplained;
  one.faults.resize(std::min<size_t>(one.faults.size(), 1));
  one.rival.clear();
  one.fraction = selection.fraction;
  one.left = selection.left;
  return result;
}

}  // namespace

Causes ExplainLaw(const StepStore& store) {
  if (store.size() == 0 || store.law() == nullptr || store.law()->history().snapshots().empty()) return {};
  const auto differs = store.Get(StepStore::kLawDiffers);
  std::vector<Index> steps;
  for (Index i = 0; i < store.size(); ++i)
    if (differs(0, i) > 0.0) steps.push_back(i);
  if (steps.empty()) return {};
  const Explanation start = StartExplanation(store, CauseChannel::kLaw, steps);
  FoundCauses exact = ExplainLaw(store, start, 1.0);
  // A law that has the engine's numbers differs from one that has the model's by the digits that these lack.
  const double tolerated = CalcBound(*FindCheck("law_torque"), store.setup().scenario()) / kLawTorqueBound;
  if (exact.holds || tolerated == 1.0) return std::move(exact.causes);
  FoundCauses rough = ExplainLaw(store, start, tolerated);
  return std::move(rough.holds ? rough.causes : exact.causes);
}

}  // namespace dexcheck
