#pragma once

// Which of many possible faults explain a residual, several at once, and how sure that is.
//
// A residual y (N) is whitened, so that its noise is 1. Each candidate has columns C (N x p) that a fault of
// amplitude 1 would leave in it. Sought is the set S of candidates that minimises
//
//   n log(floor + |y - C_S a|^2 / N) + p_S log n + 2 |S| log m
//
// (the extended Bayesian information criterion of n samples and m candidates, of which p_S amplitudes are
// fitted)
//
// by orthogonal matching pursuit, in which every choice is looked at again after each that follows it, and
// which ends where no more than noise is left.

#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "controller/common/types.h"

namespace dexcheck {

/// A fault at a place.
struct Candidate {
  std::string fault;     ///< "torque gain".
  std::string place;     ///< "motor r_elbow".
  std::string unit;      ///< Of the value; empty for a factor.
  std::string detail;    ///< More about it: "at 4.77 Hz".
  double nominal = 0.0;  ///< The value without the fault: the amplitude is added to it.
  MatrixXd columns;      ///< N x p.
  int parameters = 0;    ///< That were fitted beforehand, besides the amplitudes.
  VectorXd fitted;       ///< These, where they are needed again: a point.
  /// How large each amplitude may plausibly be (p); empty for any size. What less than that does not show
  /// above the noise is not estimated.
  VectorXd scale;
  /// The smallest that each amplitude can be (p), but for its error and what columns are off: no friction is
  /// negative. Empty for any.
  VectorXd least;
  /// Whether an amplitude can be: no mass is negative. Empty for all.
  std::function<bool(const VectorXd&)> is_possible;
  /// It is as likely as a simpler one that explains no less: a spring that does not move is a torque.
  bool is_ordinary = false;
};

/// A candidate that is part of the explanation.
struct CauseTerm {
  size_t candidate = 0;
  VectorXd amplitude, error;  ///< p, with standard errors: infinite where nothing is known of it.
  double fraction = 0.0;      ///< Of |y|^2 that is left over without it.
  /// Candidates that would do as well in its place with no more columns, and their amplitudes there: the
  /// motion does not separate them.
  std::vector<std::pair<size_t, VectorXd>> same;
  size_t rival = SIZE_MAX;  ///< The next best in its place; SIZE_MAX for none.
  double log_odds = 0.0;    ///< Against the rival, natural logarithm.
};

struct CauseSelection {
  std::vector<CauseTerm> terms;  ///< The one that explains most first.
  double fraction = 0.0;         ///< Of |y|^2 that they explain.
  double left = 0.0;             ///< Root mean square of the remainder, in units of noise.
  double criterion = 0.0;
  VectorXd residual;  ///< What is left over (N).
};

struct CauseOptions {
  size_t most_terms = 5;
  size_t restarts = 3;  ///< Other first choices that are tried where the first led nowhere.
  bool exchanges_pairs =
      true;  ///< Whether two terms are exchanged at once, too; with many of them that takes long.
  /// By how much an exchange must lower the criterion. Where rows are known to rounding, an exchange that is
  /// right lowers it by many times their number.
  double least_gain = 0.005;
  /// Candidates of one column each with which the search begins once more, of all of them but the needless:
  /// what several explain together may look like something else to one at a time.
  std::vector<size_t> start;
  /// Mean square of what no explanation need explain: noise, and what the columns are off themselves.
  double floor = 1.0;
  /// Rows whose noise is one and the same: 1 where each has its own. N / noise_block_size are counted then.
  double noise_block_size = 1.0;
  /// Number of samples, where y and the columns are sums with the same products; 0 for the rows of y.
  double rows = 0.0;
  /// Part of a column beside others that counts: less is rounding.
  double independent = 1e-7;
};

/// Candidates whose likelihoods differ by less than this factor count as equal, natural logarithm.
inline constexpr double kEqualLogOdds = 5.0;

/// See above. @param y (N). @param candidates each with N rows.
CauseSelection SelectCauses(const VectorXd& y, std::span<const Candidate> candidates,
                            const CauseOptions& options);

}  // namespace dexcheck
