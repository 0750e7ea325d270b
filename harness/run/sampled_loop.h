#pragma once

// A control loop as it is sampled: the linearised plant as its engine steps it, sensors, law and motors.
//
// n torques act on M q_ddot + D q_dot + G q = tau, which semi-implicit Euler steps by h:
//
//   v <- v + h M^-1 (tau - D v - G q),  q <- q + h v
//
// (a plant by Runge-Kutta's method: the same to fourth order, q and v together). Rates may be filtered, and
// all measurements may be late. Every m steps, T = m h, the law sends c = -(K q + V v) of its measurements;
// motors hold it, with a delay and a lag. One period is linear in its state and in c,
//
//   x <- A x + B c,  c = -C x
//
// with A, B and C found by stepping unit vectors. The loop is stable where all eigenvalues of A - B C lie
// inside the unit circle. Broken at its torques it has the return ratio L(z) = C (z I - A)^-1 B; broken at
// torque j alone, the others closed, L_j(z) = 1 / S_jj(z) - 1 with the sensitivity S = (I + L)^-1 =
// I - C (z I - A + B C)^-1 B [Franklin, Powell, Workman 1998, 7.4; Skogestad, Postlethwaite 2005, 9.2].

#include <complex>
#include <limits>
#include <string>
#include <vector>

#include "controller/common/types.h"

namespace dexcheck {

/// Sampling of the law, with delays.
struct SampledLoop {
  double time_step = 1e-3;  ///< h, s.
  long hold = 1;            ///< m, steps that torques are held.
  double delay = 0.0;       ///< Delay of the torques, s.
  long latency = 0;         ///< Age of the measurements, steps.
  double low_pass =
      1.0;  ///< Fraction of a rate's change that its filter lets through at each step; 1 for no filter.
  [[nodiscard]] double period() const { return static_cast<double>(hold) * time_step; }
};

/// Plant and law, n x n. M, D, G as above; K and V are the law's. Units of the joints.
struct LinearLoop {
  SampledLoop timing;
  VectorXd lag;                 ///< Time constant of each motor, s. Empty for none.
  bool steps_together = false;  ///< Runge-Kutta's method.
  MatrixXd M, D, G;
  MatrixXd K, V;
};

/// One period: x <- A x + B c, c = -C x.
struct SampledSystem {
  MatrixXd A, B, C;
  double period = 0.0;  ///< s.
};
SampledSystem CalcSampledSystem(const LinearLoop& loop);

/// Distances of a loop from instability.
struct StabilityMargins {
  double gain = std::numeric_limits<double>::infinity();   ///< Least factor above 1 that makes it unstable.
  double least_gain = 0.0;                                 ///< Largest factor below 1 that makes it unstable.
  double phase = kPi;                                      ///< Least lag or lead that makes it unstable, rad.
  double delay = std::numeric_limits<double>::infinity();  ///< Least delay that makes it unstable, s.

  /// Keeps the smaller of each margin.
  void Narrow(const StabilityMargins& other);
};

/// Returns the margins of a stable loop, from its return ratio. @param w ascending, rad/s, close enough that
/// L hardly turns from one to the next. Between two, log L is linear in log w. @param L at each w.
StabilityMargins FindMargins(const std::vector<double>& w, const std::vector<std::complex<double>>& L);

/// Margins of a loop.
struct LoopMargins {
  double radius = 0.0;                  ///< Largest |eigenvalue| of A - B C.
  std::vector<StabilityMargins> loops;  ///< Margins of each torque by itself, the other loops closed.
  StabilityMargins together;            ///< Margins of all torques by the same factor, angle or delay.
  [[nodiscard]] bool is_stable() const { return radius < 1.0; }
};
/// Returns the margins; only the radius where the loop is not stable. @param together whether to compute
/// those of all torques, which takes most of the time.
LoopMargins CalcMargins(const SampledSystem& system, bool together = true);

/// Margins of a motion of joints: the least of each margin, and its joint, over all loops, each broken at its
/// torque with the others closed, in the postures of the start and of the motion's points.
struct JointMargins {
  double radius = 0.0;        ///< Largest spectral radius; from 1 on there are no margins.
  StabilityMargins least;     ///< Margins of one torque at a time.
  StabilityMargins together;  ///< Margins of the same factor, angle or delay at all torques.
  std::string gain_joint, phase_joint, delay_joint;
  [[nodiscard]] bool is_stable() const { return radius < 1.0; }
};

}  // namespace dexcheck
