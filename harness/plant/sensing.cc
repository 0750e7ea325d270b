#include "harness/plant/sensing.h"

#include <algorithm>
#include <cmath>

#include "controller/model/platform.h"

namespace dexcheck {
namespace {

/// Wheels, then joints: by the entries of tau'.
std::vector<std::string> ListNames(const RobotModel& model, bool wheels) {
  std::vector<std::string> names;
  const Base& base = model.base();
  if (wheels && base.type == BaseType::kDifferentialDrive) {
    names = {base.wheel_joint_right, base.wheel_joint_left};
  }
  for (const Joint& joint : model.joints()) names.push_back(joint.name);
  return names;
}

/// Rates below this are none, rad/s.
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
    measured->xi.head<2>() += CalcDriveVelocity(base_, noise);
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
      state.xi.head<2>() += CalcDriveVelocity(base_, Vector2d::Constant(v.dot(heading) / base_.wheel_radius));
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
