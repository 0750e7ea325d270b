#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
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

/// Whether one factor acts on all that the other one acts on: all torques' and one joint's, that of a sum and
/// that of one of its summands.
bool Holds(const LawTerm& one, const LawTerm& other) {
  const unsigned parts = other.entry->parts;
  const bool is_there = one.place_name() == other.place_name() || one.place_name() == "law";
  return !one.IsLike(other) && is_there && parts != 0 && (parts & one.entry->parts) == parts;
}

/// A factor that several have in common is no alternative to one of them.
void DropAlternatives(LawExplanation* found) {
  for (size_t i = 0; i < found->terms.size(); ++i)
    std::erase_if(found->same[i], [&](const LawTerm& same) {
      return std::ranges::any_of(found->terms, [&](const LawTerm& other) {
        return !other.IsLike(found->terms[i]) && (Holds(other, same) || Holds(same, other));
      });
    });
}

/// The fault's whole factor, and what it is of: what others have of it apart is theirs.
void MakeWhole(const LawTerm& one, const std::vector<LawTerm>& terms, std::span<const LawPartName> names,
               Fault* fault) {
  constexpr std::string_view kOf = "law of ";
  unsigned rest = one.entry->parts;
  std::string joints;
  for (const LawTerm& other : terms) {
    if (Holds(other, one)) fault->value *= 1.0 + other.sizes[0];
    if (!Holds(one, other)) continue;
    if (other.place_name() == one.place_name()) {
      rest &= ~other.entry->parts;
    } else if (other.entry->parts == one.entry->parts) {
      joints += (joints.empty() ? "" : ", ") + other.place_name().substr(kOf.size());
    } else {
      fault->detail +=
          (fault->detail.empty() ? "but for " : ", ") + other.place_name() + ": " + other.entry->fault;
    }
  }
  if (!joints.empty()) fault->place += " of all but " + joints;
  const auto name = std::ranges::find(names, rest, &LawPartName::parts);
  if (rest != one.entry->parts && name != names.end())
    fault->fault = std::string(name->name) + " (" + name->symbol + "), factor";
  if (std::abs(fault->value) < kZero) fault->value = 0.0;
}

/// A fault of several numbers without a unit has no size, and neither has one that is there as a whole.
Fault DescribeLaw(const LawTerm& term, double error) {
  const LawEntry& entry = *term.entry;
  Fault fault{entry.fault, term.place_name(), entry.nominal + term.sizes[0], error, entry.unit, ""};
  if (!entry.force || entry.is_whole) fault.error = 0.0;
  if (entry.shape_unit != nullptr) {
    fault.fault += " " + FormatNumber(term.sizes.tail<1>()[0], 6) + " " + entry.shape_unit;
  } else if (entry.is_vector) {
    constexpr int kDigits = 4;
    constexpr double kRounding = 1e-6;  // of the length
    fault.value = term.sizes.norm();
    fault.error = 0.0;
    fault.detail =
        FormatVector((term.sizes.array().abs() < kRounding * fault.value).select(0.0, term.sizes), kDigits);
  } else if (entry.unit.empty() && (entry.is_whole || term.sizes.size() > 1)) {
    fault.value = kNaN;
  } else if (std::abs(fault.value) < kZero * std::abs(entry.nominal)) {
    fault.value = 0.0;
  }
  return fault;
}

/// One explanation for each fault, the one that explains most first.
Causes DescribeAll(const Explanation& start, const LawProblem& problem, const LawExplanation& found,
                   std::span<const LawPartName> names) {
  const LawProblem::Steps& steps = problem.fitted();
  const VectorXd y = problem.GetDifferences(steps);
  const MatrixXd slopes = problem.CalcSlopes(found.terms, steps, problem.CalcChanges(found.terms, steps));
  const VectorXd scale = slopes.colwise().norm().cwiseMax(std::numeric_limits<double>::min());
  const MatrixXd scaled = slopes * scale.cwiseInverse().asDiagonal();
  const VectorXd squares =
      scale.size() > 0 ? VectorXd(CalcPseudoinverse(scaled.transpose() * scaled).diagonal()) : scale;
  const VectorXd errors = squares.cwiseMax(0.0).cwiseSqrt().cwiseQuotient(scale);
  const auto describe = [&](const LawTerm& term, double error) {
    Fault fault = DescribeLaw(term, error);
    if (term.entry->nominal == 1.0 && term.entry->unit.empty()) MakeWhole(term, found.terms, names, &fault);
    return fault;
  };
  Causes causes;
  Index first = 0;
  for (size_t i = 0; i < found.terms.size(); ++i) {
    const LawTerm& term = found.terms[i];
    std::vector<LawTerm> others = found.terms;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    Explanation& one = causes.emplace_back(start);
    one.fraction = others.empty() ? 1.0 - found.left * static_cast<double>(y.size()) / y.squaredNorm()
                                  : (y - problem.CalcChanges(others, steps)).squaredNorm() / y.squaredNorm();
    one.left = std::sqrt(found.left);
    one.faults.push_back(describe(term, term.CountNumbers() > 0 ? errors[first] : 0.0));
    first += term.CountNumbers();
    if (!found.same.empty())
      for (const LawTerm& same : found.same[i]) one.faults.push_back(describe(same, 0.0));
    one.SetOutcome();
  }
  std::ranges::stable_sort(causes, std::greater<>(), &Explanation::fraction);
  return causes;
}

/// Causes of a law's differences, and whether they explain all but noise.
struct FoundCauses {
  Causes causes;
  bool is_enough = false;
};

FoundCauses ExplainLaw(const StepStore& store, const Explanation& start, double noise) {
  const LawProblem problem(store, noise);
  const std::vector<LawPlace> places = ListLawPlaces(store.setup());
  std::vector<LawEntry> entries = ListLawEntries(store.setup(), store.law());
  std::vector<std::string> names;
  for (const SignalName& motor : store.motors())
    names.push_back("law of " + motor.place.substr(sizeof("motor ") - 1));
  std::ranges::move(ListTorqueEntries(store.setup().model(), names, problem.steps()),
                    std::back_inserter(entries));
  LawExplanation found = FindLawFaults(problem, entries, places);
  // Many faults would make what is little more than noise.
  constexpr double kMuch = 10.0;
  const VectorXd y = problem.GetDifferences(problem.fitted());
  found.is_enough =
      found.is_enough && (noise == 1.0 || y.squaredNorm() > kMuch * kMuch * static_cast<double>(y.size()));
  if (found.is_enough) DropAlternatives(&found);
  FoundCauses result{DescribeAll(start, problem, found, store.law()->ListParts()), found.is_enough};
  if (problem.is_single()) {
    result.causes.push_back(start);
    result.causes.back().faults = {{"torques of single precision", "law", kNaN, 0.0, "", ""}};
  }
  if (result.is_enough) return result;
  // The nearest stands for all.
  result.causes.resize(1, start);
  result.causes.front().outcome = CauseOutcome::kNotExplained;
  result.causes.front().faults.resize(std::min<size_t>(result.causes.front().faults.size(), 1));
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
  if (exact.is_enough || tolerated == 1.0) return std::move(exact.causes);
  FoundCauses rough = ExplainLaw(store, start, tolerated);
  return std::move(rough.is_enough ? rough.causes : exact.causes);
}

}  // namespace dexcheck
