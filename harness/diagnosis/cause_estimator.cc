#include "harness/diagnosis/cause_estimator.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include "controller/common/linear_algebra.h"
#include "harness/diagnosis/search_limit.h"
#include "harness/diagnosis/visible_columns.h"

namespace dexcheck {
namespace {

using Eigen::Index;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kImplausible = 3.0;  // times the plausible size

/// The search for one residual.
class Search {
 public:
  Search(const VectorXd& y, std::span<const Candidate> candidates, const CauseOptions& options)
      : y_(y),
        candidates_(candidates),
        options_(options),
        rows_(options.rows > 0.0 ? options.rows : static_cast<double>(y.size())),
        samples_(rows_ / options.noise_block_size),
        columns_(candidates, y, std::sqrt(options.floor * options.noise_block_size), options.independent) {}

  CauseSelection Run() {
    double criterion = Score(y_.squaredNorm(), 0.0, 0);
    if (const Best first = FindBest({}); !IsNoise({}) && first.criterion < criterion) criterion = Grow(first);
    // The best single one need not be part of the best set. With many candidates that search takes long.
    constexpr size_t kFew = 100;
    const bool may_be_fewer = chosen_.size() > 1 && candidates_.size() < kFew;
    if (options_.restarts > 0 && !chosen_.empty() && (may_be_fewer || !IsNoise(chosen_))) {
      std::vector<size_t> best = chosen_;
      std::vector<Best> firsts = Rank({});
      std::erase_if(firsts, [&](const Best& one) {
        return std::find(best.begin(), best.end(), one.candidate) != best.end() || !CanBe(one.candidate, {});
      });
      SpreadOut(1, options_.restarts, &firsts);
      for (const Best& first : firsts) {
        if (SearchLimit::IsOver()) break;
        const double other = Grow(first);
        if (other < criterion) best = chosen_, criterion = other;
      }
      chosen_ = best;
    }
    const std::vector<size_t> best = chosen_;
    // With inexact columns the search begins so only if nothing was found.
    const bool may_be_others = best.empty() ? !IsNoise(best) : best.size() > 1 && options_.floor <= 1.0;
    if (!options_.start.empty() && may_be_others && !SearchLimit::IsOver()) {
      chosen_ = Thin(options_.start);
      const double other = chosen_.empty() ? kInfinity : GrowFrom(Exchange(ScoreOf(chosen_)));
      if (other < criterion) {
        criterion = other;
      } else {
        chosen_ = best;
      }
    }
    if (options_.exchanges_pairs) criterion = ExchangePairs(criterion);
    return Finish(criterion);
  }

 private:
  struct Best {
    size_t candidate = SIZE_MAX;
    double criterion = kInfinity;
  };

  /// Adds one after another. @returns the criterion.
  double Grow(const Best& first) {
    chosen_ = {first.candidate};
    return GrowFrom(first.criterion);
  }
  double GrowFrom(double criterion) {
    while (chosen_.size() < options_.most_terms && !IsNoise(chosen_) && !SearchLimit::IsOver()) {
      const Best next = FindBest(chosen_);
      if (!(next.criterion < criterion)) break;
      chosen_.push_back(next.candidate);
      criterion = Exchange(next.criterion);
    }
    return criterion;
  }

  /// Those of a set, each of one column, that are needed: the least needed goes while that is for the better,
  /// there are too many, or amplitudes cannot be.
  [[nodiscard]] std::vector<size_t> Thin(std::vector<size_t> set) const {
    std::erase_if(set, [&](size_t i) { return columns_.CountOf(i) != 1; });
    while (!set.empty()) {
      const Solution found = Solve(set);
      // The square of the remainder grows by so much without each.
      const double squares = found.residual.squaredNorm();
      const VectorXd more =
          found.amplitude.cwiseAbs2().cwiseQuotient(found.covariance.diagonal()) * found.variance;
      std::vector<Index> impossible, all(set.size());
      std::iota(all.begin(), all.end(), Index{0});
      std::ranges::copy_if(all, std::back_inserter(impossible),
                           [&](Index k) { return !CanHave(set[static_cast<size_t>(k)], found, k); });
      const Index least = *std::ranges::min_element(impossible.empty() ? all : impossible, {},
                                                    [&](Index k) { return more[k]; });
      const auto count = static_cast<double>(set.size());
      const bool is_needed =
          Score(squares + more[least], count - 1.0, set.size() - 1) > Score(squares, count, set.size());
      if (impossible.empty() && is_needed && set.size() <= options_.most_terms) break;
      set.erase(set.begin() + least);
    }
    return set;
  }

  /// All that add something to those, the most likely first.
  [[nodiscard]] std::vector<Best> Rank(const std::vector<size_t>& beside) const {
    const std::vector<double> scores = ScoreAll(beside);
    std::vector<Best> all;
    for (size_t i = 0; i < scores.size(); ++i)
      if (std::isfinite(scores[i])) all.push_back({i, scores[i]});
    std::sort(all.begin(), all.end(), [](const Best& a, const Best& b) { return a.criterion < b.criterion; });
    return all;
  }

  /// Puts those first of which so many before them are of their place, and keeps `count`.
  void SpreadOut(std::ptrdiff_t most, size_t count, std::vector<Best>* ranked) const {
    std::vector<std::string> places;
    const auto is_new = [&](const Best& one) {
      places.push_back(candidates_[one.candidate].place);
      return std::count(places.begin(), places.end(), places.back()) <= most;
    };
    std::stable_partition(ranked->begin(), ranked->end(), is_new);
    ranked->resize(std::min(ranked->size(), count));
  }

  [[nodiscard]] double Score(double squares, double parameters, size_t terms) const {
    return samples_ * std::log(options_.floor + squares / rows_) + parameters * std::log(samples_) +
           2.0 * static_cast<double>(terms) * std::log(static_cast<double>(candidates_.size()));
  }

  [[nodiscard]] double ScoreOf(const std::vector<size_t>& set) const {
    return Score(CalcResidual(CalcRange(set)).squaredNorm(), CountParameters(set), set.size());
  }

  /// Returns y without its part in the range of Q.
  [[nodiscard]] VectorXd CalcResidual(const MatrixXd& Q) const { return y_ - Q * (Q.transpose() * y_); }

  /// Whether what these leave over is no more than noise.
  [[nodiscard]] bool IsNoise(const std::vector<size_t>& set) const {
    return CalcResidual(CalcRange(set)).squaredNorm() <= options_.floor * rows_;
  }

  [[nodiscard]] double CountParameters(const std::vector<size_t>& set) const {
    double count = 0.0;
    for (const size_t i : set) count += static_cast<double>(columns_.CountOf(i) + candidates_[i].parameters);
    return count;
  }

  /// Orthonormal columns of the range of what these candidates have.
  [[nodiscard]] MatrixXd CalcRange(const std::vector<size_t>& set) const {
    return CalcRange(columns_.Collect(set));
  }
  [[nodiscard]] MatrixXd CalcRange(const MatrixXd& C) const {
    MatrixXd Q(C.rows(), C.cols());
    Index used = 0;
    for (Index k = 0; k < C.cols(); ++k) {
      VectorXd column = C.col(k);
      const double size = column.norm();
      for (int twice = 0; twice < 2; ++twice)
        column -= Q.leftCols(used) * (Q.leftCols(used).transpose() * column);
      if (!(column.norm() > options_.independent * size)) continue;
      Q.col(used++) = column.normalized();
    }
    return Q.leftCols(used);
  }

  /// The criterion of `beside` and each candidate; infinite where it adds nothing.
  [[nodiscard]] std::vector<double> ScoreAll(const std::vector<size_t>& beside) const {
    const MatrixXd Q = CalcRange(beside);
    const VectorXd r = CalcResidual(Q);
    const VectorXd left = columns_.CalcLeft(Q, r, options_.floor * rows_);
    const double square = r.squaredNorm(), parameters = CountParameters(beside);
    std::vector<double> scores(candidates_.size(), kInfinity);
    for (size_t i = 0; i < candidates_.size(); ++i) {
      const double one = left[static_cast<Index>(i)];
      if (!(one < square) || std::find(beside.begin(), beside.end(), i) != beside.end()) continue;
      scores[i] = Score(one, parameters + CountParameters({i}), beside.size() + 1);
    }
    return scores;
  }

  /// Its amplitudes beside those; zero where they have all of it.
  [[nodiscard]] VectorXd CalcAmplitude(size_t candidate, const std::vector<size_t>& beside) const {
    const MatrixXd Q = CalcRange(beside), C = columns_.Of(candidate);
    const MatrixXd own = C - Q * (Q.transpose() * C);
    return columns_.visible(candidate).basis * SolveLeastSquares(own, CalcResidual(Q), options_.independent);
  }

  /// Returns whether all of them are possible at once.
  [[nodiscard]] bool CanBe(size_t candidate, const std::vector<size_t>& beside) const {
    std::vector<size_t> set = beside;
    set.push_back(candidate);
    const auto is_free = [&](size_t i) {
      const Candidate& one = candidates_[i];
      return !one.is_possible && one.scale.size() == 0 && one.least.size() == 0;
    };
    if (std::all_of(set.begin(), set.end(), is_free)) return true;
    const Solution found = Solve(set);
    Index begin = 0;
    for (const size_t i : set) {
      if (!CanHave(i, found, begin)) return false;
      begin += columns_.CountOf(i);
    }
    return true;
  }

  /// The fit of a set: amplitudes of the visible columns, their covariance, and the residual.
  struct Solution {
    VectorXd amplitude;
    MatrixXd covariance;
    VectorXd residual;
    double variance = 1.0;  // of the noise
    /// Changes of the amplitudes that do not show together, and those of size 1 each; empty where all show.
    MatrixXd hidden, each;
  };

  [[nodiscard]] Solution Solve(const std::vector<size_t>& set) const {
    const MatrixXd C = columns_.Collect(set);
    const VectorXd size = C.colwise().norm().cwiseMax(std::numeric_limits<double>::min());
    const MatrixXd scaled = C * size.cwiseInverse().asDiagonal();
    Solution found;
    found.amplitude = scaled.colPivHouseholderQr().solve(y_).cwiseQuotient(size);
    found.residual = y_ - C * found.amplitude;
    const double freedom = std::max(1.0, rows_ - static_cast<double>(C.cols()));
    found.variance =
        std::max(options_.floor, found.residual.squaredNorm() / freedom) * options_.noise_block_size;
    found.covariance = size.cwiseInverse().asDiagonal() * CalcPseudoinverse(scaled.transpose() * scaled) *
                       size.cwiseInverse().asDiagonal() * found.variance;
    return found;
  }

  /// Takes the least amplitudes where several share an effect.
  void Share(const std::vector<size_t>& set, Solution* found) const {
    constexpr double kTogether = 1e-11;  // rounding of columns that are combinations of others
    const MatrixXd C = columns_.Collect(set);
    const VectorXd size = C.colwise().norm().cwiseMax(std::numeric_limits<double>::min());
    const MatrixXd scaled = C * size.cwiseInverse().asDiagonal();
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> factor(scaled.rows(), scaled.cols());
    factor.setThreshold(kTogether);
    factor.compute(scaled);
    if (factor.rank() == scaled.cols()) return;
    found->amplitude = factor.solve(y_).cwiseQuotient(size);
    found->residual = y_ - C * found->amplitude;
    found->each = size.cwiseInverse().asDiagonal();
    found->hidden = found->each - found->each * (factor.pseudoInverse() * scaled);
  }

  /// Whether a candidate can have such amplitudes. @param begin of its visible columns.
  [[nodiscard]] bool CanHave(size_t candidate, const Solution& found, Index begin) const {
    const Candidate& one = candidates_[candidate];
    const Index r = columns_.CountOf(candidate);
    const Visible& visible = columns_.visible(candidate);
    VectorXd a = visible.basis * found.amplitude.segment(begin, r);
    if (one.scale.size() > 0 && (a.array().abs() > kImplausible * one.scale.array()).any()) return false;
    if (one.least.size() > 0 && (a.array() < one.least.array()).any()) {
      // Columns of derivatives that were smoothed are off by a part of themselves, which no error says.
      constexpr double kErrors = 3.0, kRelative = 0.02;
      const VectorXd error = CalcErrors(visible, found.covariance.block(begin, begin, r, r));
      if ((a.array() + kErrors * error.array() < (1.0 + kRelative) * one.least.array()).any()) return false;
    }
    return !one.is_possible || one.is_possible(a);
  }

  [[nodiscard]] Best FindBest(const std::vector<size_t>& beside) const {
    const std::vector<Best> all = Rank(beside);
    const auto best =
        std::find_if(all.begin(), all.end(), [&](const Best& one) { return CanBe(one.candidate, beside); });
    return best == all.end() ? Best{} : *best;
  }

  [[nodiscard]] std::vector<size_t> Without(size_t place) const {
    std::vector<size_t> others = chosen_;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(place));
    return others;
  }

  /// Exchanges and drops what others make worse than something else, or needless. What leaves no more than
  /// noise is kept so, whatever the criterion says: else one step would undo the other for ever. @returns the
  /// criterion.
  double Exchange(double criterion) {
    for (bool improved = true; improved && !SearchLimit::IsOver();) {
      improved = false;
      for (size_t place = 0; place < chosen_.size() && chosen_.size() > 1; ++place) {
        const std::vector<size_t> others = Without(place);
        const double alone = ScoreOf(others);
        const Best best = FindBest(others);
        const bool is_noise = IsNoise(chosen_);
        if (IsNoise(others) || (!is_noise && alone <= criterion && alone <= best.criterion)) {
          chosen_ = others, criterion = alone, improved = true;
        } else if (best.criterion < criterion - options_.least_gain && best.candidate != chosen_[place]) {
          std::vector<size_t> exchanged = chosen_;
          exchanged[place] = best.candidate;
          if (is_noise && !IsNoise(exchanged)) continue;
          chosen_ = exchanged, criterion = best.criterion, improved = true;
        }
      }
    }
    return criterion;
  }

  /// Exchanges two at once, what one lacks the other may have, for two or for one. @returns the criterion.
  double ExchangePairs(double criterion) {
    constexpr size_t kLikeliest = 12;
    for (size_t i = 0; i < chosen_.size(); ++i) {
      for (size_t k = i + 1; k < chosen_.size(); ++k) {
        std::vector<size_t> others = Without(k);
        others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
        std::vector<Best> firsts = Rank(others);
        SpreadOut(2, kLikeliest, &firsts);
        for (const Best& first : firsts) {
          if (SearchLimit::IsOver()) return criterion;
          std::vector<size_t> set = others;
          set.push_back(first.candidate);
          // One that does as well as both needs no second.
          if (first.criterion < criterion && (IsNoise(set) || !IsNoise(chosen_)) &&
              CanBe(first.candidate, others)) {
            chosen_ = set;
            return ExchangePairs(Exchange(first.criterion));
          }
          const Best second = FindBest(set);
          if (!(second.criterion < criterion - options_.least_gain)) continue;
          set.push_back(second.candidate);
          if (IsNoise(chosen_) && !IsNoise(set)) continue;
          chosen_ = set;
          return ExchangePairs(Exchange(second.criterion));
        }
      }
    }
    return criterion;
  }

  CauseSelection Finish(double criterion) {
    CauseSelection result;
    result.criterion = criterion;
    result.residual = y_;
    const double all = y_.squaredNorm();
    if (!chosen_.empty()) {
      Solution found = Solve(chosen_);
      Share(chosen_, &found);
      result.residual = found.residual;
      Index begin = 0;
      for (size_t place = 0; place < chosen_.size(); ++place) {
        const Visible& visible = columns_.visible(chosen_[place]);
        const Index r = columns_.CountOf(chosen_[place]);
        CauseTerm term;
        term.candidate = chosen_[place];
        term.amplitude = visible.basis * found.amplitude.segment(begin, r);
        if (const VectorXd& least = candidates_[term.candidate].least; least.size() > 0)
          term.amplitude = term.amplitude.cwiseMax(least);
        term.error = CalcErrors(visible, found.covariance.block(begin, begin, r, r));
        if (found.hidden.size() > 0) {
          // Together with amplitudes of others.
          constexpr double kHidden = 0.1;
          MatrixXd shared = found.hidden.middleRows(begin, r);
          shared.middleCols(begin, r).setZero();
          const VectorXd hidden = (visible.basis * shared).rowwise().norm();
          const VectorXd each = (visible.basis * found.each.middleRows(begin, r)).rowwise().norm();
          term.error = (hidden.array() > kHidden * each.array()).select(kInfinity, term.error);
        }
        Compare(place, criterion, all, &term);
        begin += r;
        result.terms.push_back(std::move(term));
      }
    }
    std::sort(result.terms.begin(), result.terms.end(),
              [](const CauseTerm& a, const CauseTerm& b) { return a.fraction > b.fraction; });
    result.fraction = all > 0.0 ? 1.0 - result.residual.squaredNorm() / all : 1.0;
    result.left = std::sqrt(result.residual.squaredNorm() / std::max(1.0, rows_));
    return result;
  }

  /// Finds the candidates that would do in its place.
  void Compare(size_t place, double criterion, double all, CauseTerm* term) const {
    const std::vector<size_t> others = Without(place);
    term->fraction = all > 0.0 ? CalcResidual(CalcRange(others)).squaredNorm() / all : 0.0;
    const std::vector<double> scores = ScoreAll(others);
    double best = kInfinity;
    for (size_t i = 0; i < scores.size(); ++i) {
      if (i == term->candidate || !std::isfinite(scores[i])) continue;
      // The criterion is twice the negative logarithm of the likelihood.
      double odds = 0.5 * (scores[i] - criterion);
      // One with more columns has simpler ones as a special case, unless only fewer of theirs show.
      const double more = CountParameters({i}) - CountParameters({term->candidate});
      const Candidate &own = candidates_[term->candidate], &other = candidates_[i];
      const bool is_wider = other.columns.cols() + other.parameters > own.columns.cols() + own.parameters;
      if (more > 0.0 && other.is_ordinary) odds -= 0.5 * more * std::log(samples_);
      if (odds < kEqualLogOdds && more > 0.0 && is_wider && !other.is_ordinary) continue;
      // Another shape of the same fault is no rival of it.
      const bool is_shape = other.fault == own.fault && other.place == own.place;
      if ((odds >= kEqualLogOdds && (odds >= best || is_shape)) || !CanBe(i, others)) continue;
      if (odds < kEqualLogOdds) {
        term->same.emplace_back(i, CalcAmplitude(i, others));
      } else {
        best = odds;
        term->rival = i;
        term->log_odds = odds;
      }
    }
  }

  const VectorXd& y_;
  std::span<const Candidate> candidates_;
  CauseOptions options_;
  double rows_, samples_;
  VisibleColumns columns_;
  std::vector<size_t> chosen_;
};

}  // namespace

CauseSelection SelectCauses(const VectorXd& y, std::span<const Candidate> candidates,
                            const CauseOptions& options) {
  return Search(y, candidates, options).Run();
}

}  // namespace dexcheck
