#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "controller/common/types.h"
#include "controller/control/reading.h"
#include "harness/plant/imperfections.h"
#include "harness/plant/plant.h"
#include "harness/plant/random_stream.h"

namespace dexcheck {

// Velocities from positions.

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
  KalmanGains(double sigma, double R, double time_step) : R_(R) {
    const Vector2d g = sigma * time_step * Vector2d(time_step, 1.0);
    F_(0, 1) = time_step;
    Q_ = g * g.transpose();
  }

  /// Predicts one step: P = F P F^T + Q, F = [1 dt; 0 1], Q = sigma^2 dt^2 [dt; 1] [dt; 1]^T.
  void Predict() { P_ = F_ * P_ * F_.transpose() + Q_; }
  /// Corrects by a measured position: sets the gains of position and velocity on the innovation.
  void Correct() {
    k_ = P_.col(0) / (P_(0, 0) + R_);
    P_ -= (k_ * P_.row(0)).eval();
  }
  /// Begins with a position as exact as its measurement, and a velocity with standard deviation `spread`.
  void Reset(double spread) { P_ = Vector2d(R_, spread * spread).asDiagonal(); }

  [[nodiscard]] const Matrix2d& F() const { return F_; }
  [[nodiscard]] const Vector2d& k() const { return k_; }  ///< Of position and velocity: 1, 1/s.

 private:
  Matrix2d F_ = Matrix2d::Identity(), Q_ = Matrix2d::Zero(), P_ = Matrix2d::Zero();
  Vector2d k_ = Vector2d::Zero();
  double R_ = 0.0;
};

/// A Kalman filter of one coordinate with KalmanGains.
class VelocityFilter {
 public:
  VelocityFilter() = default;
  VelocityFilter(double sigma, double R, double time_step) : gains_(sigma, R, time_step) {}

  void Reset(double y, double v) {
    // The first velocity is the plant's at rest, or nearly.
    constexpr double kStartSpread = 0.1;
    gains_.Reset(kStartSpread);
    x_ << y, v;
  }
  void Update(double y) {
    gains_.Predict();
    gains_.Correct();
    x_ = (gains_.F() * x_).eval();
    x_ += gains_.k() * (y - x_[0]);
  }
  [[nodiscard]] double v() const { return x_[1]; }

 private:
  KalmanGains gains_;
  Vector2d x_ = Vector2d::Zero();  // position, velocity
};

/// Pose and body velocity of the object.
struct ObjectMotion {
  Pose X_Bo = Pose::Identity();
  Vector6d V_Bo = Vector6d::Zero();  ///< Sigma_o.
};

/// A camera that sees the object with noise, periodically and late. Nothing allocates after construction.
class ObjectSensor {
 public:
  /// @param options those that begin with object_.
  ObjectSensor(const SensingOptions& options, double time_step, std::uint64_t seed);

  [[nodiscard]] bool is_exact() const { return is_exact_; }
  /// Returns the measurement of the true motion at step k = 0, 1, ...
  ObjectMotion Measure(const ObjectMotion& true_motion, std::uint64_t k);
  /// Moves everything by `way` (m, world) from now on.
  void Translate(const Vector3d& way);
  /// Adds `v` (m/s, world) to the object's velocity from step k on: remembered values change with it.
  void AddVelocity(const Vector3d& v, std::uint64_t k);
  /// Age of the pose that is measured at step k, steps.
  [[nodiscard]] double FindAge(std::uint64_t k) const;

 private:
  [[nodiscard]] ObjectMotion Sample(const ObjectMotion& true_motion, std::uint64_t k) const;
  void Start();
  void Difference(const ObjectMotion& seen);
  void Filter(const Pose& seen, bool is_new);
  [[nodiscard]] Vector6d CalcBodyVelocity(const Matrix3d& R) const;

  SensingOptions options_;
  bool is_exact_;
  double time_step_;
  RandomStream position_noise_, orientation_noise_;
  long period_ = 1;                    // steps from one pose to the next
  std::vector<ObjectMotion> delayed_;  // ring of poses seen
  double low_pass_ = 1.0;
  ObjectMotion seen_;  // last of all
  bool has_seen_ = false;
  // kDifferenced, kKalman: as old as the pose is when it arrives.
  Pose estimate_ = Pose::Identity();
  Vector3d p_dot_ = Vector3d::Zero();  // world, m/s
  Vector3d omega_ = Vector3d::Zero();  // body, rad/s
  KalmanGains position_gains_, orientation_gains_;
};

/// The sensors between the plant and the controller: encoders, tachometers, odometry, a camera, a latency.
/// Two objects of the same options make the same measurements of the same true states: a check makes its own.
/// Nothing allocates after construction, once `measurement` has its sizes.
class Sensing {
 public:
  /// @throws InputError when the options name parts that the robot does not have.
  Sensing(const SensingOptions& options, const PartContext& context);

  /// Measures the true state; once at each step, from the first one on.
  void Measure(const PlantReading& true_reading, Reading* measured);
  /// Moves robot and object by `way` (m, world) from now on, remembered values included.
  void Translate(const Vector3d& way);
  /// Adds `v` (m/s, world) to the velocity of platform and object from now on, for a run that starts moving:
  /// remembered values become as if they had always moved so.
  void AddVelocity(const Vector3d& v);

 private:
  void MeasureJoints(MeasuredState* measured);
  void MeasureBase(const MeasuredState& true_state, MeasuredState* measured);
  void MeasureVelocity(int joint, double position, double* rate);

  SensingOptions options_;
  bool is_exact_;
  Base base_;
  int base_positions_, base_velocities_;
  double time_step_;
  VectorXd count_;                         // one step of each encoder, rad; 0 is exact
  VectorXd joint_noise_, velocity_noise_;  // velocities: wheels first
  RandomStream joint_stream_, velocity_stream_, force_stream_;
  std::vector<VelocityFilter> filters_;  // by joint; kKalman
  VectorXd last_, rate_;                 // kDifferenced
  double low_pass_ = 1.0;
  Vector3d odometry_ = Vector3d::Zero();  // x, y, phi
  ObjectSensor object_;
  std::vector<Reading> delayed_;  // ring; empty without latency
  std::uint64_t k_ = 0;           // steps measured
};

}  // namespace dexcheck
