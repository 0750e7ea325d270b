#include "harness/diagnosis/cause_estimator.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

namespace dexcheck {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// A column of which less is left beside the others says nothing of its own.
constexpr double kIndependent = 1e-7;

/// The search for one residual.
class Search {
 public:
  Search(const VectorXd& y, std::span<const Candidate> candidates, const CauseOptions& options)
      : y_(y), candidates_(candidates), options_(options), rows_(static_cast<double>(y.size())), samples_(rows_ / options.alike) {}

  CauseSelection Run() {
    double criterion = Score(y_.squaredNorm(), 0.0, 0);
    while (chosen_.size() < options_.most_terms && !IsNoise(chosen_)) {
      const Best next = FindBest(chosen_);
      if (!(next.criterion < criterion)) break;
      chosen_.push_back(next.candidate);
      criterion = Exchange(next.criterion);
    }
    return Finish(criterion);
  }

 private:
  struct Best {
    size_t candidate = SIZE_MAX;
    double criterion = kInfinity;
  };

  [[nodiscard]] double Score(double squares, double parameters, size_t terms) const {
    return samples_ * std::log(options_.floor + squares / rows_) + parameters * std::log(samples_) +
           2.0 * static_cast<double>(terms) * std::log(static_cast<double>(candidates_.size()));
  }

  /// Whether what these leave over is no more than noise.
  [[nodiscard]] bool IsNoise(const std::vector<size_t>& set) const {
    const MatrixXd Q = CalcRange(set);
    return (y_ - Q * (Q.transpose() * y_)).squaredNorm() <= options_.floor * rows_;
  }

  [[nodiscard]] double CountParameters(const std::vector<size_t>& set) const {
    double count = 0.0;
    for (const size_t i : set)
      count += static_cast<double>(candidates_[i].columns.cols() + candidates_[i].parameters);
    return count;
  }

  /// Orthonormal columns of the range of what these candidates have.
  [[nodiscard]] MatrixXd CalcRange(const std::vector<size_t>& set) const {
    Eigen::Index width = 0;
    for (const size_t i : set) width += candidates_[i].columns.cols();
    MatrixXd Q(y_.size(), width);
    Eigen::Index used = 0;
    for (const size_t i : set) {
      const MatrixXd& C = candidates_[i].columns;
      for (Eigen::Index k = 0; k < C.cols(); ++k) {
        VectorXd column = C.col(k);
        const double size = column.norm();
        for (int twice = 0; twice < 2; ++twice)
          column -= Q.leftCols(used) * (Q.leftCols(used).transpose() * column);
        if (!(column.norm() > kIndependent * size)) continue;
        Q.col(used++) = column.normalized();
      }
    }
    return Q.leftCols(used);
  }

  /// The criterion of `beside` and each candidate; infinite where it adds nothing.
  [[nodiscard]] std::vector<double> ScoreAll(const std::vector<size_t>& beside) const {
    const MatrixXd Q = CalcRange(beside);
    const VectorXd r = y_ - Q * (Q.transpose() * y_);
    const double parameters = CountParameters(beside);
    std::vector<double> scores(candidates_.size(), kInfinity);
    for (size_t i = 0; i < candidates_.size(); ++i) {
      const MatrixXd& C = candidates_[i].columns;
      if (C.cols() == 0 || std::find(beside.begin(), beside.end(), i) != beside.end()) continue;
      const double explained = CalcExplained(C, Q, r);
      if (!(explained > 0.0) || !IsPossible(candidates_[i], Q, r)) continue;
      scores[i] = Score(std::max(0.0, r.squaredNorm() - explained), parameters + CountParameters({i}),
                        beside.size() + 1);
    }
    return scores;
  }

  /// Square of r's projection on what C has beside Q.
  static double CalcExplained(const MatrixXd& C, const MatrixXd& Q, const VectorXd& r) {
    MatrixXd own = C - Q * (Q.transpose() * C);
    double explained = 0.0;
    for (Eigen::Index k = 0; k < own.cols(); ++k) {
      const double size = own.col(k).norm();
      if (!(size > kIndependent * C.col(k).norm())) continue;
      own.col(k) /= size;
      const double along = own.col(k).dot(r);
      explained += along * along;
      for (Eigen::Index j = k + 1; j < own.cols(); ++j)
        own.col(j) -= own.col(k).dot(own.col(j)) * own.col(k);
    }
    return explained;
  }

  static bool IsPossible(const Candidate& candidate, const MatrixXd& Q, const VectorXd& r) {
    if (candidate.columns.cols() != 1 || !std::isfinite(candidate.least)) return true;
    const VectorXd own = candidate.columns.col(0) - Q * (Q.transpose() * candidate.columns.col(0));
    constexpr double kRounding = 1e-6;
    return own.dot(r) >= (candidate.least - kRounding * std::abs(candidate.least)) * own.squaredNorm();
  }

  [[nodiscard]] Best FindBest(const std::vector<size_t>& beside) const {
    const std::vector<double> scores = ScoreAll(beside);
    const auto best = std::min_element(scores.begin(), scores.end());
    if (best == scores.end()) return {};
    return {static_cast<size_t>(best - scores.begin()), *best};
  }

  [[nodiscard]] std::vector<size_t> Without(size_t place) const {
    std::vector<size_t> others = chosen_;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(place));
    return others;
  }

  /// Exchanges and drops what others make worse than something else, or needless. @returns the criterion.
  double Exchange(double criterion) {
    for (bool improved = true; improved;) {
      improved = false;
      for (size_t place = 0; place < chosen_.size() && chosen_.size() > 1; ++place) {
        const std::vector<size_t> others = Without(place);
        const MatrixXd Q = CalcRange(others);
        const double alone = Score((y_ - Q * (Q.transpose() * y_)).squaredNorm(), CountParameters(others), others.size());
        const Best best = FindBest(others);
        if (IsNoise(others) || (alone <= criterion && alone <= best.criterion)) {
          chosen_ = others;
          criterion = alone;
          improved = true;
        } else if (best.criterion < criterion - kEqualLogOdds * 1e-3 && best.candidate != chosen_[place]) {
          chosen_[place] = best.candidate;
          criterion = best.criterion;
          improved = true;
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
      Eigen::Index width = 0;
      for (const size_t i : chosen_) width += candidates_[i].columns.cols();
      MatrixXd C(y_.size(), width);
      width = 0;
      for (const size_t i : chosen_) {
        C.middleCols(width, candidates_[i].columns.cols()) = candidates_[i].columns;
        width += candidates_[i].columns.cols();
      }
      const VectorXd size = C.colwise().norm().cwiseMax(std::numeric_limits<double>::min());
      const MatrixXd scaled = C * size.cwiseInverse().asDiagonal();
      const Eigen::ColPivHouseholderQR<MatrixXd> qr(scaled);
      const VectorXd a = qr.solve(y_).cwiseQuotient(size);
      result.residual = y_ - C * a;
      const double freedom = std::max(1.0, rows_ - static_cast<double>(width));
      const double variance =
          std::max(options_.floor, result.residual.squaredNorm() / freedom) * options_.alike;
      const MatrixXd covariance =
          (scaled.transpose() * scaled).completeOrthogonalDecomposition().pseudoInverse() * variance;
      width = 0;
      for (size_t place = 0; place < chosen_.size(); ++place) {
        const Eigen::Index p = candidates_[chosen_[place]].columns.cols();
        CauseTerm term;
        term.candidate = chosen_[place];
        term.amplitude = a.segment(width, p);
        term.error =
            covariance.diagonal().segment(width, p).cwiseMax(0.0).cwiseSqrt().cwiseQuotient(size.segment(width, p));
        Compare(place, criterion, all, &term);
        width += p;
        result.terms.push_back(std::move(term));
      }
    }
    std::sort(result.terms.begin(), result.terms.end(),
              [](const CauseTerm& a, const CauseTerm& b) { return a.fraction > b.fraction; });
    result.fraction = all > 0.0 ? 1.0 - result.residual.squaredNorm() / all : 1.0;
    result.left = std::sqrt(result.residual.squaredNorm() / std::max(1.0, rows_));
    return result;
  }

  /// What would do in its place.
  void Compare(size_t place, double criterion, double all, CauseTerm* term) const {
    const std::vector<size_t> others = Without(place);
    const MatrixXd Q = CalcRange(others);
    const VectorXd r = y_ - Q * (Q.transpose() * y_);
    term->fraction = all > 0.0 ? r.squaredNorm() / all : 0.0;
    const std::vector<double> scores = ScoreAll(others);
    double best = kInfinity;
    for (size_t i = 0; i < scores.size(); ++i) {
      if (i == term->candidate) continue;
      // The criterion is twice the negative logarithm of the likelihood.
      double odds = 0.5 * (scores[i] - criterion);
      // One with more columns has simpler ones as a special case.
      const double more = CountParameters({i}) - CountParameters({term->candidate});
      if (more > 0.0 && candidates_[i].is_ordinary) odds -= 0.5 * more * std::log(samples_);
      if (odds < kEqualLogOdds && more > 0.0 && !candidates_[i].is_ordinary) continue;
      if (odds < kEqualLogOdds) {
        const MatrixXd& C = candidates_[i].columns;
        const MatrixXd own = C - Q * (Q.transpose() * C);
        term->same.emplace_back(i, own.colPivHouseholderQr().solve(r));
      } else if (odds < best) {
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
  std::vector<size_t> chosen_;
};

}  // namespace

CauseSelection SelectCauses(const VectorXd& y, std::span<const Candidate> candidates,
                            const CauseOptions& options) {
  return Search(y, candidates, options).Run();
}

}  // namespace dexcheck
