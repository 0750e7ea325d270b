#include "harness/checks/soft_constraint.h"

#include <algorithm>
#include <cmath>

#include "harness/base/worst.h"

namespace dexcheck {

Softness CalcSoftness(const mjOption& option, const mjtNum* solref, const mjtNum* solimp, double r,
                      double r_error) {
  double time = solref[0], ratio = solref[1];
  if ((time > 0.0) != (ratio > 0.0)) time = 0.02, ratio = 1.0;  // the engine's default
  const bool is_safe = (option.disableflags & mjDSBL_REFSAFE) == 0;
  if (time > 0.0 && is_safe) time = Worst(time, 2.0 * option.timestep);
  const auto limit = [](double impedance) { return std::clamp(impedance, mjMINIMP, mjMAXIMP); };
  const double d0 = limit(solimp[0]), d1 = limit(solimp[1]), middle = limit(solimp[3]);
  const double width = solimp[2], power = Worst(1.0, solimp[4]);
  Softness soft;
  soft.K = time > 0.0 ? 1.0 / Worst(mjMINVAL, Squared(d1 * time * ratio)) : -time / Squared(d1);
  soft.B = time > 0.0 ? 2.0 / Worst(mjMINVAL, d1 * time) : -ratio / d1;
  soft.d = 0.5 * (d0 + d1);
  soft.d_error = kSumErrors;
  if (d0 == d1 || width <= mjMINVAL) return soft;
  // Two powers that meet in the middle, where the slope is the largest: `power`.
  const double x = std::abs(r) / width;
  const double y = x >= 1.0      ? 1.0
                   : x <= middle ? middle * std::pow(x / middle, power)
                                 : 1.0 - (1.0 - middle) * std::pow((1.0 - x) / (1.0 - middle), power);
  soft.d = d0 + y * (d1 - d0);
  soft.d_error += power * std::abs(d1 - d0) / width * r_error;
  return soft;
}

double SoftCone::CalcR(const Softness& soft, const InverseInertia& w) {
  R_error = w.error + soft.d_error / (soft.d * (1.0 - soft.d));
  return Worst(mjMINVAL, w.value * (1.0 - soft.d) / soft.d);
}

void SoftCone::Add(const Softness& soft, const PointMotion& motion, const Vector6d& along, double along_error,
                   double r, double r_error) {
  const Eigen::RowVector2d sizes(along.head<3>().norm(), along.tail<3>().norm());
  Matrix2d lengths;  // of the linear and angular part
  lengths << motion.value.topRows<3>().colwise().norm(), motion.value.bottomRows<3>().colwise().norm();
  const Eigen::RowVector2d rates = along.transpose() * motion.value;
  const Eigen::RowVector2d error = sizes * (motion.error.matrix() + (along_error + kSumErrors) * lengths);
  const double stiff = soft.K * soft.d * r;
  const size_t i = size++;
  y[i] = rates[0] + soft.B * rates[1] + stiff;
  y_error[i] = error[0] + soft.B * error[1] + soft.K * (soft.d * r_error + soft.d_error * std::abs(r)) +
               kSumErrors * (std::abs(rates[0]) + std::abs(soft.B * rates[1]) + std::abs(stiff));
}

std::array<double, 6> SoftCone::CalcFreeForces() const {
  std::array<double, 6> force{};
  for (size_t i = 0; i < size; ++i) force[i] = -y[i] / R[i];
  return force;
}

double SoftCone::CalcForceError(size_t row, double force) const {
  double squared = 0.0;
  for (size_t i = 0; i < size; ++i) squared += Squared(y_error[i]) / R[i];
  return std::sqrt(squared / R[row]) + R_error * std::abs(force);
}

}  // namespace dexcheck
