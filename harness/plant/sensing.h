#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "controller/control/controller.h"
#include "harness/plant/imperfections.h"
#include "harness/plant/object_sensor.h"
#include "harness/plant/part_context.h"
#include "harness/plant/plant_reading.h"
#include "harness/plant/random_stream.h"
#include "harness/plant/velocity_filter.h"

namespace dexcheck {

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
