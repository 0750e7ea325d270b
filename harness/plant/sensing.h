#pragma once

#include <cstdint>
#include <vector>

#include "controller/control/reading.h"
#include "harness/plant/imperfections.h"
#include "harness/plant/plant.h"
#include "harness/plant/random_stream.h"
#include "harness/plant/velocity_filter.h"

namespace dexcheck {

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
