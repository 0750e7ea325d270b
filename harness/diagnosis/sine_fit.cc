#include "harness/diagnosis/sine_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "controller/common/linear_algebra.h"

namespace dexcheck {

double FindMost(const std::function<double(double x)>& score, double begin, double end, double step,
                double least, int halvings) {
  double best = begin, most = least;
  const auto try_one = [&](double x) {
    const double value = score(x);
    if (value > most) most = value, best = x;
  };
  for (int i = 0; begin + i * step < end; ++i) try_one(begin + i * step);
  for (int i = 0; i < halvings; ++i, step *= 0.5) {
    const double centre = best;
    try_one(centre - 0.5 * step);
    try_one(centre + 0.5 * step);
  }
  return best;
}

using Eigen::ArrayXd;

Sine FindSine(const ArrayXd& y, const ArrayXd& x) {
  const ArrayXd since = x - x.minCoeff();
  std::vector<double> apart;
  for (Eigen::Index i = 1; i < x.size(); ++i) apart.push_back(std::abs(x[i] - x[i - 1]));
  const double densest = 0.4 / Median(std::move(apart)),
               grid = 0.25 / since.maxCoeff();  // four for a period in all of it
  MatrixXd columns(y.size(), 2);
  // Minus the square of the rest of y beside a sine of this frequency.
  const auto score = [&](double frequency) {
    if (!(frequency > grid)) return -std::numeric_limits<double>::infinity();
    columns << (2.0 * kPi * frequency * since).sin(), (2.0 * kPi * frequency * since).cos();
    return -(y.matrix() - columns * SolveLeastSquares(columns, y.matrix())).squaredNorm();
  };
  // Blocks of steps with gaps between them explain several frequencies nearly as well: so many are refined,
  // of those that are better than their neighbours on the grid.
  constexpr size_t kMostRefined = 8;
  constexpr int kMostTried = 2000, kHalvings = 32;
  std::vector<double> scores;
  for (int i = 2; i < std::min<double>(kMostTried, densest / grid); ++i) scores.push_back(score(i * grid));
  std::vector<std::pair<double, double>> starts;
  for (size_t i = 0; i < scores.size(); ++i)
    if ((i == 0 || scores[i] >= scores[i - 1]) && (i + 1 == scores.size() || scores[i] >= scores[i + 1]))
      starts.emplace_back(-scores[i], static_cast<double>(i + 2) * grid);
  std::sort(starts.begin(), starts.end());
  if (starts.size() > kMostRefined) starts.resize(kMostRefined);
  double best = 2.0 * grid;
  for (const auto& [left, start] : starts) {
    const double near =
        FindMost(score, start, start + grid, 2.0 * grid, -std::numeric_limits<double>::infinity(), kHalvings);
    if (score(near) > score(best)) best = near;
  }
  score(best);
  return {best, columns};
}

}  // namespace dexcheck
