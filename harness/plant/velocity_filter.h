#pragma once

// Velocities from positions.

#include <cmath>

#include "controller/common/types.h"

namespace dexcheck {

/// First-order low pass of a value that is held between steps: y += a (u - y), a = 1 - exp(-2 pi f dt), whose
/// response to a step is that of 1 / (1 + s / (2 pi f)) at the samples. f = 0 passes everything.
inline double CalcLowPassGain(double cutoff, double time_step) {
  return cutoff > 0.0 ? 1.0 - std::exp(-2.0 * kPi * cutoff * time_step) : 1.0;
}

/// Covariance and gains of the Kalman filter of a position with random acceleration. Positions and velocities
/// step as the plant's do (semi-implicit Euler):
///
///   v_{k+1} = v_k + dt a_k,   x_{k+1} = x_k + dt v_{k+1},   y_k = x_k + n_k
///
/// with a and n white, of standard deviations sigma and sqrt(R).
class KalmanGains {
 public:
  KalmanGains() = default;
  /// @param sigma m/s^2 or rad/s^2. @param R variance of the position measured, m^2 or rad^2.
  KalmanGains(double sigma, double R, double time_step)
      : dt_(time_step), q_(sigma * sigma * time_step * time_step), R_(R) {}

  /// Predicts one step: P = F P F^T + Q, F = [1 dt; 0 1], Q = sigma^2 dt^2 [dt; 1] [dt; 1]^T.
  void Predict() {
    xx_ += dt_ * (2.0 * xv_ + dt_ * vv_) + q_ * dt_ * dt_;
    xv_ += dt_ * vv_ + q_ * dt_;
    vv_ += q_;
  }
  /// Corrects by a measured position: sets the gains of position and velocity on the innovation.
  void Correct() {
    const double S = xx_ + R_;  // variance of the innovation
    k_x_ = xx_ / S;
    k_v_ = xv_ / S;
    vv_ -= k_v_ * xv_;
    xv_ -= k_x_ * xv_;
    xx_ -= k_x_ * xx_;
  }
  /// Begins with a position as exact as its measurement, and a velocity with standard deviation `spread`.
  void Reset(double spread) {
    xx_ = R_;
    xv_ = 0.0;
    vv_ = spread * spread;
  }

  [[nodiscard]] double k_x() const { return k_x_; }
  [[nodiscard]] double k_v() const { return k_v_; }  ///< 1/s.

 private:
  double dt_ = 0.0, q_ = 0.0, R_ = 0.0;
  double xx_ = 0.0, xv_ = 0.0, vv_ = 0.0;
  double k_x_ = 0.0, k_v_ = 0.0;
};

/// A Kalman filter of one coordinate with KalmanGains.
class VelocityFilter {
 public:
  VelocityFilter() = default;
  VelocityFilter(double sigma, double R, double time_step) : gains_(sigma, R, time_step), dt_(time_step) {}

  void Reset(double y, double v) {
    // The first velocity is the plant's at rest, or nearly.
    constexpr double kStartSpread = 0.1;
    gains_.Reset(kStartSpread);
    x_ = y;
    v_ = v;
  }
  void Update(double y) {
    gains_.Predict();
    gains_.Correct();
    x_ += dt_ * v_;
    const double innovation = y - x_;
    x_ += gains_.k_x() * innovation;
    v_ += gains_.k_v() * innovation;
  }
  [[nodiscard]] double x() const { return x_; }
  [[nodiscard]] double v() const { return v_; }

 private:
  KalmanGains gains_;
  double dt_ = 0.0;
  double x_ = 0.0, v_ = 0.0;
};

}  // namespace dexcheck
