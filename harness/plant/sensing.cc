#include "harness/plant/sensing.h"

#include <algorithm>
#include <cmath>

#include "controller/object/so3.h"
#include "harness/plant/plant.h"

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

// Standard deviation that a filter expects of the object's velocity before the first step, m/s and rad/s.
constexpr double kStartSpread = 0.1;

/// Lists the names of wheels, then of joints, by the entries of tau'.
std::vector<std::string> ListNames(const RobotModel& model, bool wheels) {
  std::vector<std::string> names;
  const Base& base = model.base();
  if (wheels && base.type == BaseType::kDifferentialDrive) {
    names = {base.wheel_joint_right, base.wheel_joint_left};
  }
  for (const Joint& joint : model.joints()) names.push_back(joint.name);
  return names;
}

/// Rates below this count as zero, rad/s.
constexpr double kStandstill = 1e-30;

Reading MakeReading(const PartContext& context) {
  Reading reading;
  reading.state.q.setZero(context.model->num_positions());
  reading.state.xi.setZero(context.model->num_velocities());
  reading.state.kappa.resize(context.num_contacts);
  reading.state.overlap.resize(context.num_contacts);
  return reading;
}

}  // namespace

ObjectSensor::ObjectSensor(const SensingOptions& options, double time_step, std::uint64_t seed)
    : options_(options),
      is_exact_(!HasObjectFault(options)),
      time_step_(time_step),
      position_noise_(seed, "sensing.object_position_noise"),
      orientation_noise_(seed, "sensing.object_orientation_noise"),
      period_(options.object_rate > 0.0 ? CountSteps(1.0 / options.object_rate, time_step) : 1),
      delayed_(static_cast<size_t>(CountSteps(options.object_latency, time_step)) + 1),
      low_pass_(CalcLowPassGain(options.object_velocity_cutoff, static_cast<double>(period_) * time_step)),
      position_gains_(options.object_acceleration,
                      options.object_position_noise * options.object_position_noise, time_step),
      orientation_gains_(options.object_acceleration,
                         options.object_orientation_noise * options.object_orientation_noise, time_step) {}

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
  std::ranges::fill(delayed_, seen_);
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
  estimate_.translation() += position_gains_.k()[0] * e_p;
  p_dot_ += position_gains_.k()[1] * e_p;
  // Products of rotations leave the group by rounding.
  estimate_.linear() = Eigen::Quaterniond(estimate_.linear() * ExpSo3(orientation_gains_.k()[0] * e_R))
                           .normalized()
                           .toRotationMatrix();
  omega_ += orientation_gains_.k()[1] * e_R;
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

Sensing::Sensing(const SensingOptions& options, const PartContext& context)
    : options_(options),
      is_exact_(options.is_exact()),
      base_(context.model->base()),
      base_positions_(context.model->num_base_positions()),
      base_velocities_(context.model->num_base_velocities()),
      time_step_(context.time_step),
      joint_stream_(context.seed, "sensing.joint_noise"),
      velocity_stream_(context.seed, "sensing.velocity_noise"),
      force_stream_(context.seed, "sensing.contact_force_noise"),
      low_pass_(CalcLowPassGain(options.velocity_cutoff, context.time_step)),
      object_(options, context.time_step, context.seed) {
  const RobotModel& model = *context.model;
  const std::vector<std::string> joints = ListNames(model, /*wheels=*/false);
  const std::vector<std::string> all = ListNames(model, /*wheels=*/true);
  joint_noise_ = options.joint_noise.Resolve(joints, context.source);
  velocity_noise_ = options.velocity_noise.Resolve(all, context.source);
  count_ = options.joint_counts.Resolve(joints, context.source);
  for (Eigen::Index i = 0; i < count_.size(); ++i) {
    const bool turns = model.joint(static_cast<int>(i)).type == JointType::kRevolute;
    if (count_[i] > 0.0) count_[i] = (turns ? 2.0 * kPi : 1.0) / count_[i];
    // A position that is rounded to whole counts is off by up to half of one, evenly: variance q^2 / 12.
    const double variance = joint_noise_[i] * joint_noise_[i] + count_[i] * count_[i] / 12.0;
    filters_.emplace_back(options.kalman_acceleration, variance, time_step_);
  }
  last_ = rate_ = VectorXd::Zero(count_.size());
  const long latency = CountSteps(options.latency, time_step_);
  if (latency > 0) delayed_.assign(static_cast<size_t>(latency) + 1, MakeReading(context));
}

void Sensing::Measure(const PlantReading& true_reading, Reading* measured) {
  measured->state = true_reading.state;
  measured->touch = true_reading.touch;
  if (is_exact_) return;
  MeasureJoints(&measured->state);
  MeasureBase(true_reading.state, &measured->state);
  if (!object_.is_exact()) {
    const ObjectMotion object = object_.Measure({true_reading.state.X_Bo, true_reading.state.V_Bo}, k_);
    measured->state.X_Bo = object.X_Bo;
    measured->state.V_Bo = object.V_Bo;
  }
  for (ContactCoordinates& kappa : measured->state.kappa) kappa.alpha_o.u += options_.contact_error;
  if (options_.contact_force_noise > 0.0) {
    measured->touch.support_force += options_.contact_force_noise * force_stream_.Normal(k_);
  }
  if (!delayed_.empty()) {
    if (k_ == 0) delayed_.assign(delayed_.size(), *measured);
    delayed_[k_ % delayed_.size()] = *measured;
    *measured = delayed_[(k_ + 1) % delayed_.size()];
  }
  ++k_;
}

void Sensing::MeasureVelocity(int joint, double position, double* rate) {
  VelocityFilter& filter = filters_[static_cast<size_t>(joint)];
  if (options_.velocity == VelocitySource::kKalman) {
    if (k_ == 0) {
      filter.Reset(position, *rate);
    } else {
      filter.Update(position);
    }
    *rate = filter.v();
  } else if (options_.velocity == VelocitySource::kDifferenced) {
    if (k_ == 0) {
      rate_[joint] = *rate;
    } else {
      rate_[joint] += low_pass_ * ((position - last_[joint]) / time_step_ - rate_[joint]);
      // Between two counts the filter's output decays for ever.
      if (std::abs(rate_[joint]) < kStandstill) rate_[joint] = 0.0;
    }
    last_[joint] = position;
    *rate = rate_[joint];
  }
}

void Sensing::MeasureJoints(MeasuredState* measured) {
  const auto wheels = static_cast<int>(velocity_noise_.size() - count_.size());
  for (int i = 0; i < static_cast<int>(count_.size()); ++i) {
    double& q = measured->q[base_positions_ + i];
    double& rate = measured->xi[base_velocities_ + i];
    const auto channel = static_cast<std::uint64_t>(i);
    if (joint_noise_[i] > 0.0) q += joint_noise_[i] * joint_stream_.Normal(k_, channel);
    if (count_[i] > 0.0) q = count_[i] * std::round(q / count_[i]);
    if (options_.velocity != VelocitySource::kMeasured) {
      MeasureVelocity(i, q, &rate);
    } else if (velocity_noise_[wheels + i] > 0.0) {
      rate +=
          velocity_noise_[wheels + i] * velocity_stream_.Normal(k_, static_cast<std::uint64_t>(wheels + i));
    }
  }
}

void Sensing::MeasureBase(const MeasuredState& true_state, MeasuredState* measured) {
  if (base_positions_ == 0) return;
  if (base_.type == BaseType::kDifferentialDrive) {
    Vector2d noise = Vector2d::Zero();  // of the wheels' rates
    for (int i = 0; i < 2; ++i) {
      if (velocity_noise_[i] > 0.0) {
        noise[i] = velocity_noise_[i] * velocity_stream_.Normal(k_, static_cast<std::uint64_t>(i));
      }
    }
    measured->xi.head<2>() += base_.velocity == DriveVelocity::kTwist ? CalcTwist(base_, noise) : noise;
  }
  if (!options_.odometry) return;
  if (k_ == 0) {
    odometry_ = true_state.q.head<3>();
  } else if (base_.type == BaseType::kPlanar) {
    odometry_ += time_step_ * measured->xi.head<3>();
  } else {
    Vector2d twist = measured->xi.head<2>();
    if (base_.velocity == DriveVelocity::kWheelRates) twist = CalcTwist(base_, twist);
    // Velocities are those of the middle of the step that has led here.
    const double phi = odometry_[2] + 0.5 * time_step_ * twist[1];
    odometry_ += time_step_ * Vector3d(twist[0] * std::cos(phi), twist[0] * std::sin(phi), twist[1]);
  }
  measured->q.head<3>() = odometry_;
}

void Sensing::AddVelocity(const Vector3d& v) {
  const auto size = static_cast<std::uint64_t>(delayed_.size());
  for (std::uint64_t j = k_ - std::min(k_, size); j < k_; ++j) {
    MeasuredState& state = delayed_[j % size].state;
    const double age = static_cast<double>(k_ - j);  // steps
    if (base_positions_ > 0) {
      const Vector3d heading(std::cos(state.q[2]), std::sin(state.q[2]), 0.0);
      state.q.head<2>() -= age * time_step_ * v.head<2>();
      state.xi.head<2>() += CalcDriveVelocityOfTwist(base_, {v.dot(heading), 0.0});
    }
    state.X_Bo.translation() -= (age + object_.FindAge(j)) * time_step_ * v;
    state.V_Bo.head<3>() += state.X_Bo.linear().transpose() * v;
  }
  object_.AddVelocity(v, k_);
}

void Sensing::Translate(const Vector3d& way) {
  odometry_.head<2>() += way.head<2>();
  object_.Translate(way);
  for (Reading& reading : delayed_) {
    if (base_positions_ > 0) reading.state.q.head<2>() += way.head<2>();
    reading.state.X_Bo.translation() += way;
  }
}

}  // namespace dexcheck
