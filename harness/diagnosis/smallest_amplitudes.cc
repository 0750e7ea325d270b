#include "harness/diagnosis/smallest_amplitudes.h"

#include <algorithm>
#include <cmath>

#include "harness/diagnosis/visible_columns.h"

namespace dexcheck {
namespace {

using Eigen::Index;

// Of a square: what is left of products of columns when they cancel.
constexpr double kCancelled = 1e-12;

/// Columns of all candidates side by side, and what of each shows.
struct Columns {
  Columns(std::span<const Candidate> candidates, const CauseOptions& options) {
    Index width = 0;
    for (const Candidate& one : candidates) {
      begins.push_back(width);
      width += one.columns.cols();
      visible.push_back(FindVisible(one, std::sqrt(options.floor * options.alike)));
    }
    MatrixXd all(candidates.front().columns.rows(), width);
    for (size_t i = 0; i < candidates.size(); ++i)
      all.middleCols(begins[i], candidates[i].columns.cols()) = candidates[i].columns;
    products.noalias() = all.transpose() * all;
  }

  /// What a candidate's visible amplitudes are that explain most of each column: they are orthogonal.
  [[nodiscard]] MatrixXd CalcAmplitudes(size_t candidate) const {
    const Visible& one = visible[candidate];
    return one.columns.colwise().squaredNorm().cwiseInverse().asDiagonal() * one.basis.transpose() *
           products.middleRows(begins[candidate], one.basis.rows());
  }
  /// Squares of what is left of each column then.
  [[nodiscard]] VectorXd CalcLeft(size_t candidate, const MatrixXd& amplitudes) const {
    const Eigen::RowVectorXd squares = visible[candidate].columns.colwise().squaredNorm();
    return products.diagonal() - (squares * amplitudes.cwiseAbs2()).transpose();
  }

  std::vector<Index> begins;
  std::vector<Visible> visible;
  MatrixXd products;
};

}  // namespace

std::vector<SmallestAmplitude> FindSmallestAmplitudes(
    std::span<const Candidate> candidates, const CauseOptions& options,
    const std::function<bool(size_t candidate, size_t other)>& is_like) {
  std::vector<SmallestAmplitude> all;
  if (candidates.empty()) return all;
  const Columns columns(candidates, options);
  const double rows = static_cast<double>(candidates.front().columns.rows());
  const double samples = rows / options.alike;
  // Of which amplitude n log(floor + a^2 d^2 / N) is more by that.
  const auto solve = [&](double more, double square) {
    return std::sqrt(rows * options.floor * std::expm1(more / samples) / square);
  };
  const auto count = [&](size_t i) {
    return static_cast<double>(columns.visible[i].columns.cols() + candidates[i].parameters);
  };
  const double choice = 2.0 * std::log(static_cast<double>(candidates.size()));
  for (size_t i = 0; i < candidates.size(); ++i) {
    for (Index k = 0; k < candidates[i].columns.cols(); ++k) {
      SmallestAmplitude& one = all.emplace_back();
      one.candidate = i, one.component = k;
      const double square = columns.products(columns.begins[i] + k, columns.begins[i] + k);
      if (count(i) == 0.0 || !(square > 0.0)) continue;
      one.found = std::max(solve(count(i) * std::log(samples) + choice, square),
                           std::sqrt(rows * options.floor / square));
      const VectorXd amplitude = one.found * VectorXd::Unit(candidates[i].columns.cols(), k);
      if (candidates[i].is_possible && !candidates[i].is_possible(amplitude))
        one.found = std::numeric_limits<double>::infinity();
      one.named = one.found;
    }
  }
  for (size_t j = 0; j < candidates.size(); ++j) {
    if (count(j) == 0.0) continue;
    const MatrixXd amplitudes = columns.CalcAmplitudes(j);
    const VectorXd left = columns.CalcLeft(j, amplitudes);
    for (SmallestAmplitude& one : all) {
      const double more = count(j) - count(one.candidate);
      if (!std::isfinite(one.found) || (more > 0.0 && !candidates[j].is_ordinary) ||
          is_like(one.candidate, j))
        continue;
      const Index column = columns.begins[one.candidate] + one.component;
      const double square = left[column];
      const double needed = 2.0 * kEqualLogOdds - std::min(0.0, more) * std::log(samples);
      const double named = square > kCancelled * columns.products(column, column)
                               ? solve(needed, square)
                               : std::numeric_limits<double>::infinity();
      const VectorXd there = one.found * (columns.visible[j].basis * amplitudes.col(column));
      if (named > one.named && (!candidates[j].is_possible || candidates[j].is_possible(there)))
        one.named = named, one.rival = j;
    }
  }
  return all;
}

}  // namespace dexcheck
