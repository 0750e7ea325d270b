#include "controller/handling/posture_path.h"

#include <Eigen/LU>
#include <cmath>

#include "controller/common/errors.h"

namespace dexcheck {

double PosturePath::KnotPlace(int i, int count) {
  return 0.5 * (1.0 - std::cos(kPi * static_cast<double>(i) / (count - 1)));
}

PosturePath::PosturePath(const std::vector<VectorXd>& knots) {
  const auto count = static_cast<int>(knots.size());
  Require(count >= 2, "number of knots", "must be at least two", count);
  MatrixXd powers(count, count);
  coefficients_.resize(knots.front().size(), count);
  for (int i = 0; i < count; ++i) {
    coefficients_.col(i) = knots[static_cast<size_t>(i)];
    const double x = 2.0 * KnotPlace(i, count) - 1.0;
    for (int power = 0; power < count; ++power) powers(i, power) = std::pow(x, power);
  }
  // knots = coefficients powers^T
  const MatrixXd inverse = powers.inverse();
  coefficients_ = (coefficients_ * inverse.transpose()).eval();
}

void PosturePath::Evaluate(double s, VectorXd* q, VectorXd* q_s, VectorXd* q_ss) const {
  const double x = 2.0 * s - 1.0;
  q->setZero(size());
  q_s->setZero(size());
  q_ss->setZero(size());
  for (Eigen::Index power = coefficients_.cols() - 1; power >= 0; --power) {
    *q_ss = x * *q_ss + 2.0 * *q_s;
    *q_s = x * *q_s + *q;
    *q = x * *q + coefficients_.col(power);
  }
  *q_s *= 2.0;
  *q_ss *= 4.0;
}

VectorXd PosturePath::Evaluate(double s) const {
  VectorXd q, q_s, q_ss;
  Evaluate(s, &q, &q_s, &q_ss);
  return q;
}

}  // namespace dexcheck
