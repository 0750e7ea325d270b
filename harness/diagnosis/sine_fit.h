#pragma once

// The sine of unknown frequency that explains most of a series.

#include "controller/common/types.h"

namespace dexcheck {

/// a sin(2 pi f (x - x_0)) + b cos(2 pi f (x - x_0)), x_0 the least x.
struct Sine {
  double frequency = 0.0;  ///< f, periods per unit of x.
  MatrixXd columns;        ///< N x 2, of size 1.
};

/// @param y N. @param x N, in any order, not all equal. Looked for from half a period in all of x to two
/// values a period.
Sine FindSine(const Eigen::ArrayXd& y, const Eigen::ArrayXd& x);

}  // namespace dexcheck
