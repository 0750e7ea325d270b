#include "harness/diagnosis/law_search.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "harness/diagnosis/search_limit.h"

namespace dexcheck {
namespace {

using Eigen::Index;

// Faults whose sizes are searched that are fitted alone, faults beside which others are looked for, of many
// faults fewer, sets that are fitted, and pairs beside which a third is looked for.
constexpr size_t kAlone = 40, kFirsts = 40, kFewFirsts = 8, kNear = 8, kFitted = 40, kWidened = 3;
constexpr double kVisible = 1e-7;  // part of a column beside others that shows

/// The columns of a fault that are independent of each other.
Index CountRank(const LawTerm& fault, const MatrixXd& columns) {
  if (columns.cols() == 0) return 0;
  Eigen::ColPivHouseholderQR<MatrixXd> solver;
  solver.setThreshold(kVisible);
  return solver.compute(columns * LawProblem::CalcScale(fault, columns).cwiseInverse().asDiagonal()).rank();
}

/// Orthonormal columns of the same range.
MatrixXd FindRange(const MatrixXd& columns) {
  if (columns.cols() == 0) return columns;
  const Eigen::ColPivHouseholderQR<MatrixXd> solver(columns);
  return solver.householderQ() * MatrixXd::Identity(columns.rows(), solver.rank());
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
      : problem_(problem), entries_(entries), places_(places), y_(problem.GetDifferences(problem.fitted())) {}

  LawExplanation Run() {
    if (const LawExplanation none{.left = y_.squaredNorm() / static_cast<double>(y_.size())};
        problem_.is_single() && Explains(none))
      found_.push_back(none);
    for (const LawEntry& entry : entries_)
      if (entry.force) AddLinear(entry);
    DropRepeated();
    constexpr size_t kMany = 600;
    are_many_ = effects_.size() > kMany;
    std::vector<LawExplanation> singles, pairs, triples;
    for (const Effect& one : effects_) AddSingle(one, &singles);
    AddStarts();
    Widen({LawExplanation()}, kAlone, &singles);
    KeepBest(are_many_ ? kFewFirsts : kFirsts, &singles);
    if (found_.empty()) Widen(singles, kFitted, &pairs);
    KeepBest(kWidened, &pairs);
    if (found_.empty()) Widen(pairs, kFitted, &triples);
    // The likeliest single fault is the nearest where nothing explains the differences.
    return found_.empty() && !singles.empty() ? singles.front() : Choose();
  }

 private:
  static constexpr int kFine = 20;  // iterations
  /// The effect of a fault alone in the steps that are fitted: of sizes of 1, or by the changes of sizes at
  /// which they are searched.
  struct Effect {
    LawTerm term;
    MatrixXd columns;
  };

  /// Forces of sizes of 1 in a law that has other faults.
  [[nodiscard]] std::vector<MatrixXd> CalcForces(const LawEntry& entry,
                                                 const std::vector<LawTerm>& beside) const {
    std::vector<MatrixXd> forces;
    for (const size_t step : problem_.fitted())
      problem_.At(step, beside, [&](const LawAtStep& at) { forces.push_back(entry.force(at)); });
    return forces;
  }

  void AddLinear(const LawEntry& entry) {
    const std::vector<MatrixXd> forces = CalcForces(entry, {});
    const Index p = forces.front().cols();
    if (2 * p > y_.size()) return;  // it would explain anything
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
      const VectorXd size = part * (other.dot(y_) / other.squaredNorm());
      return is_sum || LawTerm{a.term.entry, nullptr, size}.CanBe();
    };
    std::vector<Effect> kept;
    for (Effect& one : effects_)
      if (std::ranges::none_of(kept, [&](const Effect& of) { return repeats(one, of); }))
        kept.push_back(std::move(one));
    effects_ = std::move(kept);
  }

  /// Adds the explanation by one fault alone.
  void AddSingle(const Effect& effect, std::vector<LawExplanation>* singles) {
    LawTerm term = effect.term;
    VectorXd part = VectorXd::Ones(1);
    if (!term.entry->is_whole)
      term.sizes = part =
          LawProblem::Solve(effect.columns, LawProblem::CalcScale(term, effect.columns), y_, kVisible);
    if (!term.CanBe()) return;
    const double square = (y_ - effect.columns * part).squaredNorm();
    LawExplanation one{.terms = {std::move(term)}, .left = square / static_cast<double>(y_.size())};
    if (Explains(one)) found_.push_back(one);
    singles->push_back(std::move(one));
  }

  /// Adds the faults whose sizes are searched.
  void AddStarts() {
    for (const LawEntry& entry : entries_) {
      for (const VectorXd& start : entry.starts) {
        if (SearchLimit::IsOver()) return;
        const std::vector<LawTerm> fault = {{&entry, nullptr, start}};
        const VectorXd changes = problem_.CalcChanges(fault, problem_.fitted());
        const MatrixXd slopes = problem_.CalcSlopes(fault, problem_.fitted(), changes);
        MatrixXd columns(y_.size(), 1 + slopes.cols());
        columns << changes, slopes;
        effects_.push_back({fault.front(), std::move(columns)});
      }
    }
  }

  /// Keeps the likeliest.
  void KeepBest(size_t count, std::vector<LawExplanation>* all) const {
    std::ranges::stable_sort(*all, {},
                             [&](const LawExplanation& one) { return CalcScore(one.left, one.terms); });
    if (all->size() > count) all->resize(count);
  }

  /// Adds a fault to one of some explanations, those that by their effects leave least, and fits all
  /// together.
  void Widen(const std::vector<LawExplanation>& all, size_t count, std::vector<LawExplanation>* next) {
    struct Proposal {
      std::vector<LawTerm> terms;
      double score;
    };
    std::vector<Proposal> proposals;
    std::vector<MatrixXd> forces;
    for (const LawExplanation& one : all) {
      const VectorXd changes = problem_.CalcChanges(one.terms, problem_.fitted());
      const MatrixXd Q = FindRange(problem_.CalcSlopes(one.terms, problem_.fitted(), changes));
      const VectorXd rest = y_ - changes, beside = rest - Q * (Q.transpose() * rest);
      const bool is_near = !are_many_ && !one.terms.empty() && &one < all.data() + kNear;
      const LawEntry* last = nullptr;
      for (const Effect& effect : effects_) {
        if (SearchLimit::IsOver()) return;
        const LawEntry& entry = *effect.term.entry;
        const bool is_known = one.terms.empty() && entry.force;
        if (is_known || Contains(one.terms, effect.term)) continue;
        // Those of one fault at all its places follow each other.
        if (is_near && entry.force && &entry != last) forces = CalcForces(entry, one.terms);
        last = &entry;
        const MatrixXd columns = is_near && entry.force
                                     ? problem_.CalcColumns(effect.term.place, problem_.fitted(), forces)
                                     : effect.columns;
        Proposal wider{one.terms, 0.0};
        wider.terms.push_back(effect.term);
        const double left = CalcLeft(Q, columns, beside) / static_cast<double>(y_.size());
        wider.score = CalcScore(left, wider.terms);
        if (std::isfinite(left)) proposals.push_back(std::move(wider));
      }
    }
    std::ranges::stable_sort(proposals, {}, &Proposal::score);
    if (proposals.size() > count) proposals.resize(count);
    for (Proposal& one : proposals)
      if (!SearchLimit::IsOver()) Fit({.terms = std::move(one.terms)}, next);
  }

  /// Fits the faults together.
  void Fit(LawExplanation one, std::vector<LawExplanation>* next) {
    // Faults of the torques themselves act last, as in the list.
    std::ranges::sort(one.terms, {}, [](const LawTerm& term) { return term.entry; });
    if (one.terms.size() > 1 && !IsNew(one)) return;
    constexpr int kRough = 3;
    problem_.Fit(problem_.few(), kRough, &one.terms);
    one.left = problem_.Fit(problem_.fitted(), kFine, &one.terms);
    if (!std::ranges::all_of(one.terms, &LawTerm::CanBe)) return;
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

  static bool Contains(const std::vector<LawTerm>& terms, const LawTerm& term) {
    return std::ranges::any_of(terms, [&](const LawTerm& one) { return one.IsLike(term); });
  }

  /// Whether faults at such places have not been looked at.
  bool IsNew(const LawExplanation& one) {
    auto& key = seen_.emplace_back();
    for (const LawTerm& term : one.terms) key.emplace_back(term.entry, term.place);
    return std::ranges::count(seen_, key) == 1;
  }

  /// Minus twice the logarithm of the likelihood, with what faults and their numbers cost. @param left mean
  /// square.
  [[nodiscard]] double CalcScore(double left, const std::vector<LawTerm>& terms) const {
    const auto rows = static_cast<double>(y_.size());
    return rows * std::log(1.0 + left) +
           static_cast<double>(static_cast<Index>(terms.size()) + CountNumbers(terms)) * std::log(rows);
  }

  [[nodiscard]] bool Explains(const LawExplanation& one) const {
    constexpr double kMostLeft = 3.0;  // times the noise
    // An explanation with as many numbers as there are rows explains anything, and several faults of many
    // numbers each nearly so.
    constexpr Index kRowsPerNumber = 6;
    Index most = 0;
    for (const LawTerm& fault : one.terms) most = std::max(most, fault.CountNumbers());
    const Index numbers = CountNumbers(one.terms);
    if (numbers > 1 && kRowsPerNumber * (3 * numbers - 2 * most) > y_.size()) return false;
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
    if (found_.empty()) return {};
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
  VectorXd y_;  // of the steps that are fitted
  std::vector<Effect> effects_;
  bool are_many_ = false;  // so that only some of them are looked at beside others
  std::vector<LawExplanation> found_;
  std::vector<std::vector<std::pair<const LawEntry*, const LawPlace*>>> seen_;
};

}  // namespace

LawExplanation FindLawFaults(const LawProblem& problem, std::span<const LawEntry> entries,
                             std::span<const LawPlace> places) {
  return LawSearch(problem, entries, places).Run();
}

}  // namespace dexcheck
