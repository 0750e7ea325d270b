#include "harness/diagnosis/sine_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "controller/common/linear_algebra.h"

namespace dexcheck {
namespace {

using Eigen::ArrayXd;

/// Blocks of steps with gaps between them explain several frequencies nearly as well: so many are refined.
constexpr size_t kMostRefined = 8;

/// Between two values that follow each other, the median.
double FindSpacing(const ArrayXd& x) {
  std::vector<double> apart;
  for (Eigen::Index i = 1; i < x.size(); ++i) apart.push_back(std::abs(x[i] - x[i - 1]));
  std::nth_element(apart.begin(), apart.begin() + static_cast<std::ptrdiff_t>(apart.size() / 2), apart.end());
  return apart[apart.size() / 2];
}

class SineSearch {
 public:
  SineSearch(const ArrayXd& y, const ArrayXd& x) : y_(y), x_(x - x.minCoeff()), columns_(y.size(), 2) {
    const double whole = x_.maxCoeff();
    densest_ = 0.4 / FindSpacing(x);
    grid_ = 0.25 / whole;  // four times as dense as periods in all of it
  }

  Sine Find() {
    double best = 2.0 * grid_, least = std::numeric_limits<double>::infinity();
    for (const double start : ListStarts()) {
      const auto [frequency, left] = Refine(start);
      if (left < least) least = left, best = frequency;
    }
    Try(best);
    return {best, columns_};
  }

 private:
  /// Returns the residual of y beside a sine of this frequency.
  double Try(double frequency) {
    const double w = 2.0 * kPi * frequency;
    columns_.col(0) = (w * x_).sin();
    columns_.col(1) = (w * x_).cos();
    const VectorXd a = SolveLeastSquares(columns_, y_.matrix());
    return (y_.matrix() - columns_ * a).squaredNorm();
  }

  /// Frequencies of the grid that are better than their neighbours, the best first.
  std::vector<double> ListStarts() {
    const int count = static_cast<int>(std::min(2000.0, densest_ / grid_));
    std::vector<double> left;
    for (int i = 2; i < count; ++i) left.push_back(Try(i * grid_));
    std::vector<std::pair<double, double>> least;
    for (size_t i = 0; i < left.size(); ++i) {
      const bool is_least =
          (i == 0 || left[i] <= left[i - 1]) && (i + 1 == left.size() || left[i] <= left[i + 1]);
      if (is_least) least.emplace_back(left[i], static_cast<double>(i + 2) * grid_);
    }
    std::sort(least.begin(), least.end());
    if (least.size() > kMostRefined) least.resize(kMostRefined);
    std::vector<double> starts;
    for (const auto& one : least) starts.push_back(one.second);
    return starts;
  }

  std::pair<double, double> Refine(double best) {
    double least = Try(best), width = grid_;
    for (int i = 0; i < 60; ++i, width *= 0.7) {
      for (const double to : {best - width, best + width}) {
        if (!(to > grid_)) continue;
        const double left = Try(to);
        if (left < least) least = left, best = to;
      }
    }
    return {best, least};
  }

  const ArrayXd& y_;
  ArrayXd x_;
  MatrixXd columns_;
  double densest_ = 0.0, grid_ = 0.0;
};

}  // namespace

Sine FindSine(const ArrayXd& y, const ArrayXd& x) { return SineSearch(y, x).Find(); }

}  // namespace dexcheck
