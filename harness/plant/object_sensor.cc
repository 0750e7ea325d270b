#include "harness/plant/object_sensor.h"

#include <algorithm>

#include "controller/object/so3.h"

namespace dexcheck {
namespace {

bool HasObjectFault(const SensingOptions& options) {
  return options.object_position_noise > 0.0 || options.object_orientation_noise > 0.0 ||
         options.object_rate > 0.0 || options.object_latency > 0.0 ||
         options.object_velocity != VelocitySource::kMeasured;
}

Vector3d DrawNormal(const RandomStream& stream, std::uint64_t k) {
  return {stream.Normal(k, 0), stream.Normal(k, 1), stream.Normal(k, 2)};
}

// What a filter expects of the object's velocity before the first step, m/s and rad/s.
constexpr double kStartSpread = 0.1;

}  // namespace

ObjectSensor::ObjectSensor(const SensingOptions& options, double time_step, std::uint64_t seed)
    : options_(options),
      is_exact_(!HasObjectFault(options)),
      time_step_(time_step),
      position_noise_(seed, "sensing.object_position_noise"),
      orientation_noise_(seed, "sensing.object_orientation_noise"),
      period_(options.object_rate > 0.0 ? CountSteps(1.0 / options.object_rate, time_step) : 1),
      delayed_(static_cast<size_t>(CountSteps(options.object_latency, time_step)) + 1),
      low_pass_(CalcLowPassGain(options.object_velocity_cutoff, static_cast<double>(period_) * time_step)) {
  const double position = options.object_position_noise;
  const double orientation = options.object_orientation_noise;
  position_gains_ = KalmanGains(options.object_acceleration, position * position, time_step);
  orientation_gains_ = KalmanGains(options.object_acceleration, orientation * orientation, time_step);
}

ObjectMotion ObjectSensor::Sample(const ObjectMotion& true_motion, std::uint64_t k) const {
  ObjectMotion seen = true_motion;
  if (options_.object_position_noise > 0.0) {
    seen.X_Bo.translation() += options_.object_position_noise * DrawNormal(position_noise_, k);
  }
  if (options_.object_orientation_noise > 0.0) {
    seen.X_Bo.linear() = true_motion.X_Bo.linear() *
                         ExpSo3(options_.object_orientation_noise * DrawNormal(orientation_noise_, k));
  }
  return seen;
}

ObjectMotion ObjectSensor::Measure(const ObjectMotion& true_motion, std::uint64_t k) {
  const bool is_first = !has_seen_;
  const auto period = static_cast<std::uint64_t>(period_);
  if (is_first || k % period == 0) seen_ = Sample(true_motion, k);
  if (is_first) Start();
  const std::uint64_t age = delayed_.size() - 1;  // steps
  delayed_[k % delayed_.size()] = seen_;
  const ObjectMotion& late = delayed_[(k + 1) % delayed_.size()];
  if (options_.object_velocity == VelocitySource::kMeasured) return late;
  const bool is_new = !is_first && k >= age && (k - age) % period == 0;
  if (options_.object_velocity == VelocitySource::kDifferenced) {
    if (is_new) Difference(late);
    return {late.X_Bo, CalcBodyVelocity(late.X_Bo.linear())};
  }
  if (!is_first) Filter(late.X_Bo, is_new);
  // The estimate is as old as the pose: it is carried on at its own velocity.
  const double late_by = static_cast<double>(age) * time_step_;
  Pose X_Bo = estimate_;
  X_Bo.translation() += late_by * p_dot_;
  X_Bo.linear() = estimate_.linear() * ExpSo3(late_by * omega_);
  return {X_Bo, CalcBodyVelocity(X_Bo.linear())};
}

void ObjectSensor::Start() {
  std::fill(delayed_.begin(), delayed_.end(), seen_);
  estimate_ = seen_.X_Bo;
  p_dot_ = seen_.X_Bo.linear() * seen_.V_Bo.head<3>();
  omega_ = seen_.V_Bo.tail<3>();
  position_gains_.Reset(kStartSpread);
  orientation_gains_.Reset(kStartSpread);
  has_seen_ = true;
}

Vector6d ObjectSensor::CalcBodyVelocity(const Matrix3d& R) const {
  Vector6d V;
  V << R.transpose() * p_dot_, omega_;
  return V;
}

void ObjectSensor::Difference(const ObjectMotion& seen) {
  const double time = static_cast<double>(period_) * time_step_;
  const Vector3d p_dot = (seen.X_Bo.translation() - estimate_.translation()) / time;
  const Vector3d omega = LogSo3(estimate_.linear().transpose() * seen.X_Bo.linear()) / time;
  p_dot_ += low_pass_ * (p_dot - p_dot_);
  omega_ += low_pass_ * (omega - omega_);
  estimate_ = seen.X_Bo;
}

void ObjectSensor::Filter(const Pose& seen, bool is_new) {
  position_gains_.Predict();
  orientation_gains_.Predict();
  estimate_.translation() += time_step_ * p_dot_;
  estimate_.linear() = estimate_.linear() * ExpSo3(time_step_ * omega_);
  if (!is_new) return;
  position_gains_.Correct();
  orientation_gains_.Correct();
  const Vector3d e_p = seen.translation() - estimate_.translation();
  const Vector3d e_R = LogSo3(estimate_.linear().transpose() * seen.linear());
  estimate_.translation() += position_gains_.k_x() * e_p;
  p_dot_ += position_gains_.k_v() * e_p;
  // Products of rotations leave the group by rounding.
  estimate_.linear() = Eigen::Quaterniond(estimate_.linear() * ExpSo3(orientation_gains_.k_x() * e_R))
                           .normalized()
                           .toRotationMatrix();
  omega_ += orientation_gains_.k_v() * e_R;
}

double ObjectSensor::FindAge(std::uint64_t k) const {
  // The filter makes up for the latency.
  if (is_exact_ || options_.object_velocity == VelocitySource::kKalman) return 0.0;
  const std::uint64_t age = delayed_.size() - 1;
  return static_cast<double>(k < age ? k : age + (k - age) % static_cast<std::uint64_t>(period_));
}

void ObjectSensor::AddVelocity(const Vector3d& v, std::uint64_t k) {
  if (!has_seen_) return;
  const auto size = static_cast<std::uint64_t>(delayed_.size());
  const auto period = static_cast<std::uint64_t>(period_);
  const auto add = [&](double age, ObjectMotion* motion) {
    motion->X_Bo.translation() -= age * time_step_ * v;
    motion->V_Bo.head<3>() += motion->X_Bo.linear().transpose() * v;
  };
  for (std::uint64_t j = k - std::min(k, size); j < k; ++j)
    add(static_cast<double>(k - j + j % period), &delayed_[j % size]);
  add(static_cast<double>(1 + (k - 1) % period), &seen_);
  // The filter's estimate is that of the step before, but for the latency.
  const bool filters = options_.object_velocity == VelocitySource::kKalman;
  const double late = filters ? static_cast<double>(size - 1) : FindAge(k - 1);
  estimate_.translation() -= (1.0 + late) * time_step_ * v;
  p_dot_ += v;
}

void ObjectSensor::Translate(const Vector3d& way) {
  for (ObjectMotion& motion : delayed_) motion.X_Bo.translation() += way;
  seen_.X_Bo.translation() += way;
  estimate_.translation() += way;
}

}  // namespace dexcheck
