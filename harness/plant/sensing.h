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

/// A camera that sees the object: with noise, now and then, and late. Nothing allocates after construction.
class ObjectSensor {
 public:
  /// @param options those that begin with object_.
  ObjectSensor(const SensingOptions& options, double time_step, std::uint64_t seed);

  [[nodiscard]] bool is_exact() const { return is_exact_; }
  /// What is measured of the true motion at step k = 0, 1, ...
  ObjectMotion Measure(const ObjectMotion& true_motion, std::uint64_t k);
  /// Everything is elsewhere from now on, by `way` (m, world).
  void Translate(const Vector3d& way);
  /// The object moves at `v` (m/s, world) more from step k on: what is remembered becomes as if it always
  /// had.
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
  std::vector<ObjectMotion> delayed_;  // ring of what was seen
  double low_pass_ = 1.0;
  ObjectMotion seen_;  // last of all
  bool has_seen_ = false;
  // kDifferenced, kKalman: as old as the pose is when it arrives.
  Pose estimate_ = Pose::Identity();
  Vector3d p_dot_ = Vector3d::Zero();  // world, m/s
  Vector3d omega_ = Vector3d::Zero();  // body, rad/s
  KalmanGains position_gains_, orientation_gains_;
};

/// Stands between the plant and the controller: encoders, tachometers, odometry, a camera, a latency. Two of
/// them that are made alike measure the same of the same true states: a check makes its own. Nothing
/// allocates after construction, once `measurement` has its sizes.
class Sensing {
 public:
  /// @throws InputError when the options name what the robot does not have.
  Sensing(const SensingOptions& options, const PartContext& context);

  /// What is measured of the true state; once at each step, from the first one on.
  void Measure(const PlantReading& true_reading, Reading* measured);
  /// Robot and object are elsewhere from now on, by `way` (m, world): what is remembered moves along.
  void Translate(const Vector3d& way);
  /// Platform and object move at `v` (m/s, world) more from now on, as a run that starts moving does: what is
  /// remembered becomes as if they always had.
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
