#pragma once

#include <vector>

#include "harness/plant/imperfections.h"
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

}  // namespace dexcheck
