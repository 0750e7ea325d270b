#include "harness/plant/motor_drive.h"

#include <algorithm>
#include <cmath>

#include "controller/common/text.h"
#include "harness/plant/plant.h"

namespace dexcheck {
namespace {

/// Reflected rotor inertia by entry of tau'.
VectorXd ListArmatures(const RobotModel& model) {
  VectorXd armature(model.num_velocities());
  armature.setConstant(model.base().wheel.armature);  // of the base's entries
  for (int i = 0; i < model.num_joints(); ++i) {
    armature[model.num_base_velocities() + i] = model.joint(i).armature;
  }
  return armature;
}

}  // namespace

MotorDrive::MotorDrive(std::span<const Motor> motors, const ActuationOptions& options,
                       const PartContext& context)
    : motors_(motors.begin(), motors.end()),
      options_(options),
      is_exact_(options.is_exact()),
      base_(context.model->base()),
      time_step_(context.time_step) {
  std::vector<std::string> names;
  for (const Motor& motor : motors) names.push_back(motor.name);
  const auto resolve = [&](const ByName& values) { return values.Resolve(names, context.source); };
  step_ = resolve(options.torque_step);
  gain_ = VectorXd::Ones(step_.size()) + resolve(options.gain_error);
  lag_ = resolve(options.lag);
  coulomb_ = resolve(options.coulomb);
  stribeck_ = resolve(options.stribeck);
  backlash_ = resolve(options.backlash);
  const VectorXd limit = resolve(options.limit);
  for (Eigen::Index i = 0; i < limit.size(); ++i)
    if (limit[i] > 0.0) motors_[static_cast<size_t>(i)].limit = limit[i];
  if (is_exact_) return;
  cut_.setZero(step_.size());
  armature_ = ListArmatures(*context.model);
  for (Eigen::Index i = 0; i < armature_.size(); ++i) {
    const bool needs = coulomb_[i] + stribeck_[i] > 0.0 || backlash_[i] > 0.0;
    if (!needs || armature_[i] > 0.0) continue;
    const std::string& key = backlash_[i] > 0.0  ? options.backlash.key
                             : coulomb_[i] > 0.0 ? options.coulomb.key
                                                 : options.stribeck.key;
    throw InputError(context.source + ": " + key + ": needs a joint with armature, got " +
                     Quote(names[static_cast<size_t>(i)]));
  }
  // A delay that is off a whole number of steps by rounding alone is that number.
  constexpr double kRounding = 1e-9;
  const double steps = options.delay / time_step_;
  double whole = std::floor(steps + kRounding * std::max(1.0, steps));
  fraction_ = std::max(0.0, steps - whole);
  if (fraction_ < kRounding * std::max(1.0, steps)) fraction_ = 0.0;
  sent_.assign(static_cast<size_t>(whole) + 2, VectorXd::Zero(step_.size()));
  rates_ = lagging_ = play_ = rotor_ = VectorXd::Zero(step_.size());
}

void MotorDrive::Apply(const VectorXd& tau, const VectorXd& xi, DriveOutput* output) {
  if (is_exact_) output->tau = tau;
  if (!tau.allFinite()) throw RunFailure("a torque is not a number");
  output->effort = CalcEffort(tau, &output->busiest_motor);
  if (!is_exact_) Drive(tau, xi, &output->tau);
  output->cut = cut_;
  if (output->effort <= 1.0 || options_.saturates()) return;
  const Motor& motor = motors_[static_cast<size_t>(output->busiest_motor)];
  throw RunFailure("motor " + Quote(motor.name) + " is at its limit, " + FormatNumber(motor.limit) + " N m");
}

void MotorDrive::ReadRates(const VectorXd& xi) {
  rates_ = xi;
  if (base_.type != BaseType::kDifferentialDrive || base_.velocity == DriveVelocity::kWheelRates) return;
  rates_.head<2>() = CalcWheelRatesOfTwist(base_, xi.head<2>());
}

void MotorDrive::Delay(VectorXd* tau) {
  const size_t ring = sent_.size();
  if (k_ == 0) std::ranges::fill(sent_, *tau);
  sent_[k_ % ring] = *tau;
  // The ring has the torques of 0 ... ring - 1 steps ago.
  const size_t whole = ring - 2;
  const VectorXd& late = sent_[(k_ + ring - whole) % ring];
  const VectorXd& later = sent_[(k_ + 1) % ring];
  if (fraction_ == 0.0) {
    *tau = late;
  } else {
    *tau = (1.0 - fraction_) * late + fraction_ * later;
  }
}

void MotorDrive::Drive(const VectorXd& tau, const VectorXd& xi, VectorXd* delivered) {
  *delivered = tau;
  if (is_exact_) return;
  ReadRates(xi);
  if (options_.delay > 0.0) Delay(delivered);
  for (Eigen::Index i = 0; i < delivered->size(); ++i) {
    double& u = (*delivered)[i];
    if (step_[i] > 0.0) u = step_[i] * std::round(u / step_[i]);
    u *= gain_[i];
    if (lag_[i] > 0.0) {
      if (k_ == 0) lagging_[i] = u;
      // y' = (u - y) / T over the step, and the mean of y
      const double away = lagging_[i] - u;
      const double decay = std::exp(-time_step_ / lag_[i]);
      lagging_[i] = u + away * decay;
      u += away * (1.0 - decay) * lag_[i] / time_step_;
    }
    const double limit = motors_[static_cast<size_t>(i)].limit;
    cut_[i] = u - std::clamp(u, -limit, limit);
    u -= cut_[i];
    if (backlash_[i] > 0.0) u = Play(i, u, rates_[i]);
    if (coulomb_[i] + stribeck_[i] > 0.0) u -= CalcFriction(i, rates_[i]);
  }
  ++k_;
}

double MotorDrive::Play(Eigen::Index i, double tau, double rate) {
  const double side = 0.5 * backlash_[i];
  if (k_ == 0) {
    play_[i] = tau < 0.0 ? -side : side;
    rotor_[i] = rate;
  }
  const bool at_end = std::abs(play_[i]) >= side;
  if (at_end && tau * play_[i] >= 0.0) {
    rotor_[i] = rate;
    return tau;
  }
  // The rotor is free, the joint moves below it.
  rotor_[i] += time_step_ * tau / armature_[i];
  play_[i] = std::clamp(play_[i] + time_step_ * (rotor_[i] - rate), -side, side);
  return 0.0;
}

double MotorDrive::CalcFriction(Eigen::Index i, double rate) const {
  const double slow = rate / options_.stribeck_velocity;
  const double size = coulomb_[i] + stribeck_[i] * std::exp(-slow * slow);
  const double smooth = time_step_ * (coulomb_[i] + stribeck_[i]) / armature_[i];
  return size * std::clamp(rate / smooth, -1.0, 1.0);
}

double MotorDrive::CalcEffort(const VectorXd& tau, int* busiest) const {
  double largest = 0.0;
  for (size_t i = 0; i < motors_.size(); ++i) {
    const double effort = std::abs(tau[static_cast<Eigen::Index>(i)]) / motors_[i].limit;
    if (effort <= largest) continue;
    largest = effort;
    *busiest = static_cast<int>(i);
  }
  return largest;
}

}  // namespace dexcheck
