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

constexpr size_t kFitted = 40, kFirsts = 40, kPairs = 40, kSeeds = 8, kNext = 10, kWidened = 3;

constexpr double kVisible = 1e-7;  // part of a column beside others that shows

/// The columns of a fault that are independent of each other.
Index CountRank(const LawTerm& fault, const MatrixXd& columns) {
  if (columns.cols() == 0) return 0;
  Eigen::ColPivHouseholderQR<MatrixXd> solver;
  solver.setThreshold(kVisible);
  return solver.compute(columns * LawProblem::CalcScale(fault, columns).cwiseInverse().asDiagonal()).rank();
}

/// The square of what columns leave of y, both beside the orthonormal Q.
double CalcLeft(const MatrixXd& Q, MatrixXd columns, const VectorXd& rest) {
  const Eigen::ArrayXd whole = columns.colwise().norm();
  columns -= Q * (Q.transpose() * columns);
  const Eigen::ArrayXd own = columns.colwise().norm();
  columns *= (own > kVisible * whole).select(own.inverse(), 0.0).matrix().asDiagonal();
  return (rest - columns * columns.colPivHouseholderQr().solve(rest)).squaredNorm();
}

class LawSearch {
 public:
  LawSearch(const LawProblem& problem, std::span<const LawEntry> entries, std::span<const LawPlace> places)
      : problem_(problem),
        entries_(entries),
        places_(places),
        whole_y_(problem.GetDifferences(problem.fitted())),
        y_(problem.GetDifferences(problem.few())) {}

  LawExplanation Run() {
    if (const LawExplanation none{.left = whole_y_.squaredNorm() / static_cast<double>(whole_y_.size())};
        problem_.is_single() && Explains(none))
      found_.push_back(none);
    for (const LawEntry& entry : entries_)
      if (entry.force) AddLinear(entry);
    DropRepeated();
    for (size_t i = 0; i < effects_.size(); ++i) AddSingle(i);
    std::vector<LawExplanation> fitted, pairs, triples;
    Widen({}, kFitted, &fitted);
    for (const LawExplanation& one : fitted) {
      effects_.push_back({one.terms.front(), problem_.CalcChanges(one.terms, problem_.fitted())});
      AddSingle(effects_.size() - 1);
    }
    std::ranges::stable_sort(singles_, {}, &Single::score);
    if (found_.empty()) pairs = FitPairs();
    for (size_t i = 0; i < std::min(kSeeds, singles_.size()) && found_.empty() && !are_many(); ++i)
      Widen(singles_[i].one, kNext, &pairs);
    std::ranges::sort(pairs, {}, &LawExplanation::left);
    for (size_t i = 0; i < std::min(kWidened, pairs.size()) && found_.empty() && !are_many(); ++i)
      Widen(pairs[i], kNext, &triples);
    return Choose();
  }

 private:
  static constexpr int kFine = 20;  // iterations
  /// Whether there are so many faults that only some of them are looked at beside others.
  [[nodiscard]] bool are_many() const {
    constexpr size_t kMany = 600;
    return effects_.size() > kMany;
  }
  /// The effect of a fault alone in the steps that are fitted.
  struct Effect {
    LawTerm term;
    MatrixXd columns;  // of sizes of 1, or of a fault that is not linear its whole effect
  };
  struct Proposal {
    LawTerm term;
    double score;
  };
  struct Single {
    size_t effect;
    LawExplanation one;
    double score;
  };

  void AddLinear(const LawEntry& entry) {
    std::vector<MatrixXd> forces;
    for (const size_t step : problem_.fitted())
      problem_.At(step, {}, [&](const LawAtStep& at) { forces.push_back(entry.force(at)); });
    const Index p = forces.front().cols();
    if (2 * p > whole_y_.size()) return;  // it would explain anything
    const auto add = [&](const LawPlace* place) {
      MatrixXd columns = problem_.CalcColumns(place, problem_.fitted(), forces);
      if (columns.squaredNorm() > 0.0)
        effects_.push_back({{&entry, place, VectorXd::Ones(p)}, std::move(columns)});
    };
    if (!entry.at_places) add(nullptr);
    for (const LawPlace& place : places_)
      if (entry.at_places) add(&place);
  }

  /// Drops sums of which all but one summand vanish, and what is a factor of a part that the law has anyway.
  void DropRepeated() {
    const auto repeats = [&](const Effect& b, const Effect& a) {
      const unsigned parts = a.term.entry->parts, others = b.term.entry->parts;
      const bool is_sum =
          parts != 0 && (others & parts) == parts && a.term.place_name() == b.term.place_name();
      // A force with a size of its own, such as friction, may be what is there.
      const bool is_factor = parts != 0 && others == 0 && b.columns.cols() == 1 && b.term.entry->unit.empty();
      if (!is_sum && !is_factor) return false;
      constexpr double kSame = 1e-8;
      const auto column = a.columns.col(0), other = b.columns.col(0);
      const double square = column.squaredNorm(), product = column.dot(other);
      if (product * product < 0.5 * square * other.squaredNorm()) return false;  // saves time
      const VectorXd part = VectorXd::Constant(1, product / square);
      if (!((other - part[0] * column).norm() < kSame * other.norm())) return false;
      const VectorXd size = part * (other.dot(whole_y_) / other.squaredNorm());
      return is_sum || LawTerm{a.term.entry, nullptr, size}.CanBe();
    };
    std::vector<Effect> kept;
    for (Effect& one : effects_)
      if (std::ranges::none_of(kept, [&](const Effect& of) { return repeats(one, of); }))
        kept.push_back(std::move(one));
    effects_ = std::move(kept);
  }

  /// Adds the explanation by one fault alone.
  void AddSingle(size_t effect) {
    const MatrixXd& columns = effects_[effect].columns;
    LawTerm term = effects_[effect].term;
    VectorXd part = VectorXd::Ones(1);
    if (term.entry->force && !term.entry->is_whole)
      term.sizes = part =
          LawProblem::Solve(columns, LawProblem::CalcScale(term, columns), whole_y_, kVisible);
    const auto rows = static_cast<double>(whole_y_.size());
    LawExplanation one{.terms = {term}, .left = (whole_y_ - columns * part).squaredNorm() / rows};
    if (!term.CanBe()) return;
    const double score = CalcScore(one.left, term.CountNumbers(), rows);
    if (term.entry->force && Explains(one)) found_.push_back(one);
    singles_.push_back({effect, std::move(one), score});
  }

  /// Two faults of which the sum of the effects leaves least, fitted together.
  std::vector<LawExplanation> FitPairs() {
    struct Pair {
      size_t first, second;
      double score;
    };
    std::vector<Pair> pairs;
    const auto rows = static_cast<double>(whole_y_.size());
    for (size_t k = 0; k < std::min(are_many() ? kSeeds : kFirsts, singles_.size()); ++k) {
      const size_t i = singles_[k].effect;
      const Eigen::ColPivHouseholderQR<MatrixXd> first(effects_[i].columns);
      const MatrixXd Q = first.householderQ() * MatrixXd::Identity(whole_y_.size(), first.rank());
      const VectorXd beside = whole_y_ - Q * (Q.transpose() * whole_y_);
      for (size_t j = 0; j < effects_.size() && !SearchLimit::IsOver(); ++j) {
        const Index numbers = effects_[i].columns.cols() + effects_[j].columns.cols();
        const double left = CalcLeft(Q, effects_[j].columns, beside) / rows;
        if (i != j && std::isfinite(left)) pairs.push_back({i, j, CalcScore(left, numbers, rows)});
      }
    }
    std::ranges::sort(pairs, {}, &Pair::score);
    std::vector<LawExplanation> fitted;
    for (size_t k = 0; k < std::min(kPairs, pairs.size()) && !SearchLimit::IsOver(); ++k)
      Fit(std::numeric_limits<double>::infinity(),
          {.terms = {effects_[pairs[k].first].term, effects_[pairs[k].second].term}}, &fitted);
    return fitted;
  }

  /// Adds the likeliest faults beside those of an explanation, each fitted together with these.
  void Widen(const LawExplanation& one, size_t count, std::vector<LawExplanation>* next) {
    std::vector<Proposal> proposals = Propose(one.terms);
    std::ranges::sort(proposals, {}, &Proposal::score);
    constexpr double kHopeless = 0.5;  // of what was left
    for (size_t i = 0; i < std::min(count, proposals.size()) && !SearchLimit::IsOver(); ++i) {
      LawExplanation wider = one;
      wider.terms.push_back(std::move(proposals[i].term));
      Fit(one.terms.empty() ? std::numeric_limits<double>::infinity() : kHopeless * one.left,
          std::move(wider), next);
    }
  }

  /// Fits the faults together, and keeps them where they leave less than `most`.
  void Fit(double most, LawExplanation one, std::vector<LawExplanation>* next) {
    // Faults of the torques themselves act last, as in the list.
    std::ranges::sort(one.terms, {}, [](const LawTerm& term) { return term.entry; });
    if (one.terms.size() > 1 && !IsNew(one)) return;
    constexpr int kRough = 3;
    problem_.Fit(problem_.few(), kRough, &one.terms);
    one.left = problem_.Fit(problem_.fitted(), kFine, &one.terms);
    if (!(one.left < most) || !std::ranges::all_of(one.terms, &LawTerm::CanBe)) return;
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
      const double left = CalcLeft(Q, columns, what) / rows;
      if (std::isfinite(left)) proposals.push_back({term, CalcScore(left, 1 + term.sizes.size(), rows)});
    };
    const LawEntry* last = nullptr;
    std::vector<MatrixXd> forces(steps.size());
    for (const Effect& one : effects_) {
      if (terms.empty()) break;  // these are known alone
      const LawTerm& term = one.term;
      const LawEntry& entry = *term.entry;
      // Those of one fault at all its places follow each other.
      for (size_t k = 0; k < steps.size() && (&entry != last || entry.change); ++k)
        problem_.At(steps[k], terms, [&](const LawAtStep& at) {
          forces[k] = entry.force ? entry.force(at) : MatrixXd(entry.change(at, term.sizes));
        });
      last = &entry;
      if (!Contains(terms, term)) add(term, problem_.CalcColumns(term.place, steps, forces), beside);
    }
    for (const LawEntry& entry : entries_) {
      for (const VectorXd& start : entry.starts) {
        std::vector<LawTerm> wider = terms;
        wider.push_back({&entry, nullptr, start});
        const VectorXd others = problem_.CalcChanges(wider, steps), other = y_ - others;
        const MatrixXd slopes = problem_.CalcSlopes(wider, steps, others).rightCols(start.size());
        add(wider.back(), slopes, other - Q * (Q.transpose() * other));
        if (start.isZero() && !terms.empty()) break;  // that far the others are no better
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

  /// Minus twice the logarithm of the likelihood, with what each number costs. @param left mean square.
  static double CalcScore(double left, Index numbers, double rows) {
    return rows * std::log(1.0 + left) + static_cast<double>(numbers) * std::log(rows);
  }

  [[nodiscard]] bool Explains(const LawExplanation& one) const {
    constexpr double kMostLeft = 3.0;  // times the noise
    // An explanation with as many numbers as there are rows explains anything, and several faults of many
    // numbers each nearly so.
    constexpr Index kRowsPerNumber = 6;
    Index most = 0;
    for (const LawTerm& fault : one.terms) most = std::max(most, fault.CountNumbers());
    const Index numbers = CountNumbers(one.terms);
    if (numbers > 1 && kRowsPerNumber * (3 * numbers - 2 * most) > whole_y_.size()) return false;
    if (!(one.left <= kMostLeft * kMostLeft)) return false;
    const VectorXd aside =
        problem_.GetDifferences(problem_.aside()) - problem_.CalcChanges(one.terms, problem_.aside());
    return aside.squaredNorm() <= kMostLeft * kMostLeft * static_cast<double>(aside.size());
  }

  static Index CountNumbers(const std::vector<LawTerm>& terms) {
    Index numbers = 0;
    for (const LawTerm& term : terms) numbers += term.CountNumbers();
    return numbers;
  }

  /// The faults, and their numbers that show.
  [[nodiscard]] Index CalcCost(const LawExplanation& one) const {
    const LawProblem::Steps& steps = problem_.fitted();
    const MatrixXd slopes = problem_.CalcSlopes(one.terms, steps, problem_.CalcChanges(one.terms, steps));
    Index cost = 0, first = 0;
    for (const LawTerm& term : one.terms) {
      cost += 1 + CountRank(term, slopes.middleCols(first, term.CountNumbers()));
      first += term.CountNumbers();
    }
    return cost;
  }

  /// The one of least cost, and what others have in the place of one of its faults.
  LawExplanation Choose() {
    if (found_.empty()) return singles_.empty() ? LawExplanation{} : singles_.front().one;
    std::vector<Index> costs;
    for (const LawExplanation& one : found_) costs.push_back(CalcCost(one));
    const auto least = std::ranges::min_element(costs);
    LawExplanation best = found_[static_cast<size_t>(least - costs.begin())];
    best.is_enough = true;
    best.same.resize(best.terms.size());
    for (size_t i = 0; i < found_.size(); ++i) {
      const LawExplanation& one = found_[i];
      // Another place may show less of a vector.
      const Index more = CountNumbers(one.terms) > CountNumbers(best.terms) ? 0 : 1;
      if (costs[i] > *least + more || one.terms.size() != best.terms.size()) continue;
      std::vector<LawTerm> others;
      std::ranges::copy_if(one.terms, std::back_inserter(others),
                           [&](const LawTerm& term) { return !Contains(best.terms, term); });
      const auto replaced =
          std::ranges::find_if(best.terms, [&](const LawTerm& term) { return !Contains(one.terms, term); });
      if (others.size() == 1)
        best.same[static_cast<size_t>(replaced - best.terms.begin())].push_back(others.front());
    }
    return best;
  }

  const LawProblem& problem_;
  std::span<const LawEntry> entries_;
  std::span<const LawPlace> places_;
  VectorXd whole_y_, y_;  // of the steps that are fitted, and of few of these
  std::vector<Effect> effects_;
  std::vector<LawExplanation> found_;
  std::vector<Single> singles_;  // the likeliest first
  std::vector<std::vector<std::pair<const LawEntry*, const LawPlace*>>> seen_;
};

}  // namespace

LawExplanation FindLawFaults(const LawProblem& problem, std::span<const LawEntry> entries,
                             std::span<const LawPlace> places) {
  return LawSearch(problem, entries, places).Run();
}

}  // namespace dexcheck
