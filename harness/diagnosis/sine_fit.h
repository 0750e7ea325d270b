#pragma once

// Searches for one number: along a line, and for the frequency of a sine that explains most of a series.

#include <functional>

#include "controller/common/types.h"

namespace dexcheck {

/// The x at which a score is largest: the best of begin, begin + step, ... below `end`, moved by halves of
/// the step as often as is asked for. Where no score is above `least`, it is `begin`.
double FindMost(const std::function<double(double x)>& score, double begin, double end, double step,
                double least = 0.0, int halvings = 16);

/// a sin(2 pi f (x - x_0)) + b cos(2 pi f (x - x_0)), x_0 the least x.
struct Sine {
  double frequency = 0.0;  ///< f, periods per unit of x.
  MatrixXd columns;        ///< N x 2, of size 1.
};

/// @param y N. @param x N, in any order, not all equal. Looked for from half a period in all of x to two
/// values a period.
Sine FindSine(const Eigen::ArrayXd& y, const Eigen::ArrayXd& x);

}  // namespace dexcheck
