#include "harness/run/sampled_loop.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

namespace dexcheck {
namespace {

using Eigen::Index;
using Complex = std::complex<double>;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;

/// Moves `values` into a chain of `length` blocks of as many rows that begins at `first`, the newest first,
/// and takes out the values of `length` steps ago.
void Shift(Index first, Index length, MatrixXd* x, MatrixXd* values) {
  const Index n = values->rows();
  for (Index i = 0; i < length; ++i) x->middleRows(first + i * n, n).swap(*values);
}

/// Steps states of a LinearLoop, several at a time: one in each column.
class LoopChain {
 public:
  explicit LoopChain(const LinearLoop& loop);

  /// Number of entries of a state: q, v, the filtered rate, the lag, earlier commands and measurements.
  [[nodiscard]] Index size() const { return size_; }
  /// Measures, at the beginning of a step. @returns K q + V v of the measurements (n x columns).
  MatrixXd Measure(MatrixXd* x) const;
  /// The rest of the step. @param c torques sent (n x columns).
  void Move(const MatrixXd& c, MatrixXd* x) const;

 private:
  MatrixXd Delay(const MatrixXd& c, MatrixXd* x) const;

  LinearLoop loop_;
  Index n_, late_ = 0, size_ = 0;
  double fraction_ = 0.0;  // of a step by which the delay is more than a whole number of them
  MatrixXd A_, B_;         // of the plant's [q; v]
};

LoopChain::LoopChain(const LinearLoop& loop) : loop_(loop), n_(loop.M.rows()) {
  const double h = loop.timing.time_step;
  // The delay mixes the torques of two steps where it is no whole number of steps, as motors do.
  constexpr double kRounding = 1e-9;
  const double steps = loop.timing.delay / h;
  const double whole = std::floor(steps + kRounding * std::max(1.0, steps));
  fraction_ = std::max(0.0, steps - whole);
  if (fraction_ < kRounding * std::max(1.0, steps)) fraction_ = 0.0;
  late_ = static_cast<Index>(whole);
  size_ = (4 + 2 * loop.timing.latency + late_ + 1) * n_;
  if (loop_.lag.size() == 0) loop_.lag.setZero(n_);

  MatrixXd F = MatrixXd::Zero(2 * n_, 2 * n_), E = MatrixXd::Zero(2 * n_, n_);
  const Eigen::LLT<MatrixXd> M(loop.M);
  F.topRightCorner(n_, n_).setIdentity();
  F.bottomLeftCorner(n_, n_) = -M.solve(loop.G);
  F.bottomRightCorner(n_, n_) = -M.solve(loop.D);
  E.bottomRows(n_) = M.solve(MatrixXd::Identity(n_, n_));
  A_ = MatrixXd::Identity(2 * n_, 2 * n_);
  if (loop.steps_together) {
    // 1 + hF (1 + hF/2 (1 + hF/3 (1 + hF/4)))
    MatrixXd sum = A_;
    for (const double order : {4.0, 3.0, 2.0}) sum = A_ + h / order * F * sum;
    B_ = h * sum * E;
    A_ += h * F * sum;
  } else {
    B_ = h * E;
    A_.bottomRows(n_) += h * F.bottomRows(n_);
    A_.topRows(n_) += h * A_.bottomRows(n_);
    B_.topRows(n_) = h * B_.bottomRows(n_);
  }
}

MatrixXd LoopChain::Measure(MatrixXd* x) const {
  auto filtered = x->middleRows(2 * n_, n_);
  filtered += loop_.timing.low_pass * (x->middleRows(n_, n_) - filtered);
  MatrixXd seen(2 * n_, x->cols());
  seen << x->topRows(n_), filtered;
  Shift(4 * n_, loop_.timing.latency, x, &seen);
  return loop_.K * seen.topRows(n_) + loop_.V * seen.bottomRows(n_);
}

MatrixXd LoopChain::Delay(const MatrixXd& c, MatrixXd* x) const {
  const Index first = size_ - (late_ + 1) * n_;
  MatrixXd late = c;
  Shift(first, late_, x, &late);
  // The last block holds the command of one step earlier.
  auto last = x->bottomRows(n_);
  MatrixXd mixed = (1.0 - fraction_) * late + fraction_ * last;
  last = late;
  return mixed;
}

void LoopChain::Move(const MatrixXd& c, MatrixXd* x) const {
  MatrixXd u = Delay(c, x);
  for (Index i = 0; i < n_; ++i) {
    auto lagging = x->row(3 * n_ + i);
    if (!(loop_.lag[i] > 0.0)) {
      lagging.setZero();  // a state that stays as it is would be an eigenvalue of 1
      continue;
    }
    // y' = (u - y) / lag, its mean over the step
    const double decay = std::exp(-loop_.timing.time_step / loop_.lag[i]);
    const Eigen::RowVectorXd away = lagging - u.row(i);
    lagging = u.row(i) + decay * away;
    u.row(i) += (1.0 - decay) * loop_.lag[i] / loop_.timing.time_step * away;
  }
  x->topRows(2 * n_) = (A_ * x->topRows(2 * n_) + B_ * u).eval();
}

/// Adds the gain margin at L = -1 / factor.
void AddGain(double factor, StabilityMargins* margins) {
  if (factor > 1.0) margins->gain = std::min(margins->gain, factor);
  if (factor < 1.0) margins->least_gain = std::max(margins->least_gain, factor);
}

/// Adds an end of the frequencies, at rest or half the sampling rate, where L is real.
void AddEnd(Complex L, StabilityMargins* margins) {
  if (L.real() < 0.0 && std::abs(L.imag()) < 1e-6 * std::abs(L)) AddGain(1.0 / std::abs(L), margins);
}

constexpr int kFrequencies = 500;
constexpr double kLowest = 1e-5;  // of half the rate of sampling

std::vector<double> ListFrequencies(double period) {
  std::vector<double> w;
  for (int i = 1; i <= kFrequencies; ++i)
    w.push_back(kPi / period * std::pow(kLowest, 1.0 - i / double{kFrequencies}));
  return w;
}

/// Reorders values so that each continues the one before it.
void Match(const VectorXcd& before, VectorXcd* values) {
  for (Index i = 0; i < values->size(); ++i) {
    Index nearest = i;
    for (Index k = i + 1; k < values->size(); ++k)
      if (std::abs((*values)[k] - before[i]) < std::abs((*values)[nearest] - before[i])) nearest = k;
    std::swap((*values)[i], (*values)[nearest]);
  }
}

}  // namespace

SampledSystem CalcSampledSystem(const LinearLoop& loop) {
  const LoopChain chain(loop);
  const Index n = loop.M.rows(), size = chain.size();
  // Unit states, then unit torques.
  MatrixXd x = MatrixXd::Identity(size, size + n);
  MatrixXd c = MatrixXd::Zero(n, size + n);
  c.rightCols(n).setIdentity();
  SampledSystem system{.period = loop.timing.period()};
  for (long k = 0; k < loop.timing.hold; ++k) {
    const MatrixXd law = chain.Measure(&x);
    if (k == 0) system.C = law.leftCols(size);
    chain.Move(c, &x);
  }
  // Entries of a delay, a lag or a filter that the loop does not have are removed.
  std::vector<Index> kept;
  for (Index i = 0; i < size; ++i)
    if (!x.col(i).isZero(0.0) || !system.C.col(i).isZero(0.0)) kept.push_back(i);
  system.A = x(kept, kept);
  system.B = x.rightCols(n)(kept, Eigen::all);
  system.C = system.C(Eigen::all, kept).eval();
  return system;
}

void StabilityMargins::Narrow(const StabilityMargins& other) {
  gain = std::min(gain, other.gain);
  least_gain = std::max(least_gain, other.least_gain);
  phase = std::min(phase, other.phase);
  delay = std::min(delay, other.delay);
}

StabilityMargins FindMargins(const std::vector<double>& w, const std::vector<Complex>& L) {
  StabilityMargins margins;
  for (size_t i = 0; i + 1 < w.size(); ++i) {
    // Changes of log |L| and of the angle, measured from -1, from one frequency to the next.
    const double size = std::log(std::abs(L[i])), to_size = std::log(std::abs(L[i + 1]));
    const double angle = std::arg(-L[i]), turn = std::arg(L[i + 1] / L[i]);
    if ((size < 0.0) != (to_size < 0.0)) {
      const double part = size / (size - to_size);
      const double left = std::remainder(angle + part * turn, 2.0 * kPi);
      margins.phase = std::min(margins.phase, std::abs(left));
      const double lag = left >= 0.0 ? left : left + 2.0 * kPi;
      margins.delay = std::min(margins.delay, lag / (w[i] * std::pow(w[i + 1] / w[i], part)));
    }
    if ((angle < 0.0) != (angle + turn < 0.0) && std::abs(angle) < 0.5 * kPi)
      AddGain(std::exp(-size + angle / turn * (to_size - size)), &margins);
  }
  if (!L.empty()) AddEnd(L.back(), &margins);
  return margins;
}

LoopMargins CalcMargins(const SampledSystem& system, bool together) {
  // A - B C = U R U^*
  const Eigen::ComplexSchur<MatrixXcd> schur((system.A - system.B * system.C).cast<Complex>());
  const MatrixXcd& R = schur.matrixT();
  LoopMargins margins;
  margins.radius = R.diagonal().cwiseAbs().maxCoeff();
  if (!margins.is_stable()) return margins;
  const MatrixXcd B = schur.matrixU().adjoint() * system.B, C = system.C * schur.matrixU();
  const Index n = system.B.cols();
  const std::vector<double> w = ListFrequencies(system.period);
  std::vector<std::vector<Complex>> own(static_cast<size_t>(n)), loci(together ? own.size() : 0);
  MatrixXcd shifted;
  // Returns S, or its diagonal in a diagonal matrix where only that is needed.
  const auto evaluate = [&](Complex z) {
    shifted = R;
    shifted.diagonal().array() -= z;
    const MatrixXcd x = shifted.triangularView<Eigen::Upper>().solve(B);
    MatrixXcd S = MatrixXcd::Identity(n, n);
    if (together) return MatrixXcd(S + C * x);
    S.diagonal() += C.cwiseProduct(x.transpose()).rowwise().sum();
    return S;
  };
  const auto find_loci = [&](const MatrixXcd& S) {
    VectorXcd values = Eigen::ComplexSchur<MatrixXcd>(S, false).matrixT().diagonal().cwiseInverse();
    values.array() -= Complex(1.0);
    return values;
  };
  VectorXcd values;
  for (const double omega : w) {
    const MatrixXcd S = evaluate(std::polar(1.0, omega * system.period));
    for (Index i = 0; i < n; ++i) own[static_cast<size_t>(i)].push_back(1.0 / S(i, i) - 1.0);
    if (!together) continue;
    const VectorXcd before = std::exchange(values, find_loci(S));
    if (before.size() > 0) Match(before, &values);
    for (Index i = 0; i < n; ++i) loci[static_cast<size_t>(i)].push_back(values[i]);
  }
  for (const std::vector<Complex>& L : own) margins.loops.push_back(FindMargins(w, L));
  for (const std::vector<Complex>& L : loci) margins.together.Narrow(FindMargins(w, L));
  // The static limit counts too: a spring may be too weak to hold a load.
  const MatrixXcd S = evaluate(1.0);
  for (Index i = 0; i < n; ++i) AddEnd(1.0 / S(i, i) - 1.0, &margins.loops[static_cast<size_t>(i)]);
  if (!together) return margins;
  for (const Complex L : find_loci(S)) AddEnd(L, &margins.together);
  return margins;
}

}  // namespace dexcheck
