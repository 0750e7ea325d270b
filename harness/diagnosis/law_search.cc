#include "harness/diagnosis/law_search.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <utility>

#include "harness/diagnosis/search_limit.h"

namespace dexcheck {
namespace {

using Eigen::Index;

constexpr size_t kPairs = 20, kSeeds = 8, kNext = 10, kWidened = 3;

Index CountNumbers(const std::vector<LawTerm>& terms) {
  Index numbers = 0;
  for (const LawTerm& term : terms) numbers += term.CountNumbers();
  return numbers;
}

/// The square of what columns leave of y, both beside the orthonormal Q.
double CalcLeft(const MatrixXd& Q, MatrixXd columns, const VectorXd& rest) {
  columns -= Q * (Q.transpose() * columns);
  const VectorXd sizes = columns.colwise().norm().cwiseMax(std::numeric_limits<double>::min());
  columns *= sizes.cwiseInverse().asDiagonal();
  return (rest - columns * columns.colPivHouseholderQr().solve(rest)).squaredNorm();
}

class LawSearch {
 public:
  LawSearch(const LawProblem& problem, const LawCandidates& all, Index cost)
      : problem_(problem), all_(all), y_(problem.GetDifferences(problem.few())), cost_(cost) {}

  LawExplanation Run() {
    std::vector<LawExplanation> singles, pairs = FitPairs(), triples;
    if (found_.empty()) Widen({}, kSeeds, &singles);
    for (size_t i = 0; i < singles.size() && found_.empty(); ++i) Widen(singles[i], kNext, &pairs);
    std::ranges::sort(pairs, {}, &LawExplanation::left);
    for (size_t i = 0; i < std::min(kWidened, pairs.size()) && found_.empty(); ++i)
      Widen(pairs[i], kNext, &triples);
    return Choose();
  }

 private:
  static constexpr int kFine = 20;  // iterations
  struct Proposal {
    LawTerm term;
    double score;
  };

  /// Two faults of which the sum of the effects leaves least, fitted together.
  std::vector<LawExplanation> FitPairs() {
    std::vector<size_t> ones;
    for (size_t i = 0; i < all_.candidates().size(); ++i)
      if (all_.candidates()[i].columns.cols() == 1) ones.push_back(i);
    const VectorXd y = problem_.GetDifferences(problem_.fitted());
    MatrixXd columns(y.size(), static_cast<Index>(ones.size()));
    for (Index i = 0; i < columns.cols(); ++i)
      columns.col(i) = all_.candidates()[ones[static_cast<size_t>(i)]].columns.normalized();
    const MatrixXd products = columns.transpose() * columns;
    const VectorXd with_y = columns.transpose() * y;
    struct Pair {
      double explained;
      Index i, j;
    };
    std::vector<Pair> pairs;
    for (Index i = 0; i < columns.cols(); ++i) {
      for (Index j = i + 1; j < columns.cols(); ++j) {
        const double own = with_y[j] - products(i, j) * with_y[i],
                     part = 1.0 - products(i, j) * products(i, j);
        constexpr double kIndependent = 1e-10;  // of a square
        if (part > kIndependent) pairs.push_back({with_y[i] * with_y[i] + own * own / part, i, j});
      }
    }
    const size_t count = std::min(kPairs, pairs.size());
    std::ranges::partial_sort(pairs, pairs.begin() + static_cast<std::ptrdiff_t>(count), std::greater<>(),
                              &Pair::explained);
    std::vector<LawExplanation> fitted;
    for (size_t k = 0; k < count && !SearchLimit::IsOver(); ++k) {
      LawExplanation one;
      for (const Index i : {pairs[k].i, pairs[k].j})
        one.terms.push_back(all_.terms()[ones[static_cast<size_t>(i)]]);
      Fit(std::numeric_limits<double>::infinity(), std::move(one), &fitted);
    }
    return fitted;
  }

  /// Adds the likeliest faults beside those of an explanation, each fitted together with these.
  void Widen(const LawExplanation& one, size_t count, std::vector<LawExplanation>* next) {
    std::vector<Proposal> proposals = Propose(one.terms);
    std::ranges::sort(proposals, {}, &Proposal::score);
    constexpr double kHopeless = 0.5;  // of what was left
    const double most = one.terms.empty() ? std::numeric_limits<double>::infinity() : kHopeless * one.left;
    for (size_t i = 0; i < std::min(count, proposals.size()) && !SearchLimit::IsOver(); ++i) {
      LawExplanation wider = one;
      wider.terms.push_back(std::move(proposals[i].term));
      Fit(most, std::move(wider), next);
    }
  }

  /// Fits the faults together, and keeps them where they leave less than `most`.
  void Fit(double most, LawExplanation one, std::vector<LawExplanation>* next) {
    // Faults of the torques themselves act last, as in the list.
    std::ranges::sort(one.terms, {}, [](const LawTerm& term) { return term.entry; });
    if (one.CalcCost() >= cost_ || !IsNew(one)) return;
    constexpr int kRough = 3;
    problem_.Fit(problem_.few(), kRough, &one.terms);
    one.left = problem_.Fit(problem_.fitted(), kFine, &one.terms);
    if (!(one.left < most) || !std::ranges::all_of(one.terms, LawCandidates::CanBe)) return;
    if (Explains(one)) {
      DropNeedless(&one);
      found_.push_back(one);
    }
    next->push_back(std::move(one));
  }

  /// Drops faults without which the others explain as much: what led to these may be no part of it.
  void DropNeedless(LawExplanation* one) const {
    for (size_t i = 0; one->terms.size() > 1 && i < one->terms.size();) {
      LawExplanation fewer = *one;
      fewer.terms.erase(fewer.terms.begin() + static_cast<std::ptrdiff_t>(i));
      fewer.left = problem_.Fit(problem_.fitted(), kFine, &fewer.terms);
      if (Explains(fewer)) {
        *one = std::move(fewer);
        i = 0;
      } else {
        ++i;
      }
    }
  }

  /// All faults beside those of an explanation, with how likely each is by its derivative.
  [[nodiscard]] std::vector<Proposal> Propose(const std::vector<LawTerm>& terms) const {
    const LawProblem::Steps& steps = problem_.few();
    const VectorXd changes = problem_.CalcChanges(terms, steps), rest = y_ - changes;
    MatrixXd Q = problem_.CalcSlopes(terms, steps, changes);
    if (Q.cols() > 0) Q = MatrixXd(Q.householderQr().householderQ() * MatrixXd::Identity(Q.rows(), Q.cols()));
    const VectorXd beside = rest - Q * (Q.transpose() * rest);
    std::vector<Proposal> proposals;
    const auto add = [&](const LawTerm& term, const MatrixXd& columns, const VectorXd& what) {
      const auto rows = static_cast<double>(y_.size());
      const double left = CalcLeft(Q, columns, what) / rows,
                   numbers = static_cast<double>(1 + term.sizes.size());
      if (std::isfinite(left))
        proposals.push_back({term, rows * std::log(1.0 + left) + numbers * std::log(rows)});
    };
    const LawEntry* last = nullptr;
    std::vector<MatrixXd> forces(steps.size());
    for (const LawTerm& term : all_.terms()) {
      // Those of one fault at all its places follow each other.
      for (size_t k = 0; k < steps.size() && (term.entry != last || term.entry->change); ++k)
        problem_.At(steps[k], terms, [&](const LawAtStep& at) {
          forces[k] =
              term.entry->force ? term.entry->force(at) : MatrixXd(term.entry->change(at, term.sizes));
        });
      last = term.entry;
      if (!Contains(terms, term)) add(term, problem_.CalcColumns(term.place, steps, forces), beside);
    }
    for (const LawEntry& entry : all_.entries()) {
      for (const VectorXd& start : entry.starts) {
        std::vector<LawTerm> wider = terms;
        wider.push_back({&entry, nullptr, start});
        const VectorXd others = problem_.CalcChanges(wider, steps), other = y_ - others;
        const MatrixXd slopes = problem_.CalcSlopes(wider, steps, others).rightCols(start.size());
        add(wider.back(), slopes, other - Q * (Q.transpose() * other));
        if (start.isZero()) break;  // that far the others are no better
      }
    }
    return proposals;
  }

  static bool Contains(const std::vector<LawTerm>& terms, const LawTerm& term) {
    return std::ranges::any_of(terms, [&](const LawTerm& one) { return one.IsLike(term); });
  }

  /// Whether faults at such places have not been looked at.
  bool IsNew(const LawExplanation& one) {
    auto& key = seen_.emplace_back();
    for (const LawTerm& term : one.terms) key.emplace_back(term.entry, term.place);
    return std::ranges::count(seen_, key) == 1;
  }

  [[nodiscard]] bool Explains(const LawExplanation& one) const {
    const VectorXd aside =
        problem_.GetDifferences(problem_.aside()) - problem_.CalcChanges(one.terms, problem_.aside());
    return IsExplained(problem_, one.terms, one.left, aside);
  }

  /// The one of least cost, and what others have in the place of one of its faults.
  LawExplanation Choose() {
    if (found_.empty()) return {};
    std::ranges::stable_sort(found_, {}, &LawExplanation::CalcCost);
    LawExplanation best = found_.front();
    best.same.resize(best.terms.size());
    for (const LawExplanation& one : found_) {
      if (one.CalcCost() > best.CalcCost()) break;
      std::vector<LawTerm> others;
      std::ranges::copy_if(one.terms, std::back_inserter(others),
                           [&](const LawTerm& term) { return !Contains(best.terms, term); });
      const auto replaced =
          std::ranges::find_if(best.terms, [&](const LawTerm& term) { return !Contains(one.terms, term); });
      if (others.size() == 1 && one.terms.size() == best.terms.size())
        best.same[static_cast<size_t>(replaced - best.terms.begin())].push_back(others.front());
    }
    return best;
  }

  const LawProblem& problem_;
  const LawCandidates& all_;
  VectorXd y_;  // of few steps
  Index cost_;
  std::vector<LawExplanation> found_;
  std::vector<std::vector<std::pair<const LawEntry*, const LawPlace*>>> seen_;
};

}  // namespace

Index LawExplanation::CalcCost() const { return static_cast<Index>(terms.size()) + CountNumbers(terms); }

bool IsExplained(const LawProblem& problem, const std::vector<LawTerm>& faults, double left,
                 const VectorXd& aside) {
  constexpr double kMostLeft = 3.0;  // times the noise
  // An explanation with as many numbers as there are rows explains anything, and several faults of many
  // numbers each nearly so.
  constexpr Index kRowsPerNumber = 6;
  Index most = 0;
  for (const LawTerm& fault : faults) most = std::max(most, fault.CountNumbers());
  const Index rows = problem.GetDifferences(problem.fitted()).size(), numbers = CountNumbers(faults);
  return (numbers <= 1 || kRowsPerNumber * (2 * numbers - most) <= rows) && left <= kMostLeft * kMostLeft &&
         aside.squaredNorm() <= kMostLeft * kMostLeft * static_cast<double>(aside.size());
}

LawExplanation FindLawFaults(const LawProblem& problem, const LawCandidates& all, Index cost) {
  constexpr size_t kMany = 600;  // with which it takes long
  if (all.candidates().size() > kMany) return {};
  return LawSearch(problem, all, cost).Run();
}

}  // namespace dexcheck
