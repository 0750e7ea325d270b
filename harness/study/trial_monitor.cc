#include "harness/study/trial_monitor.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace dexcheck {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

}  // namespace

TrialMonitor::TrialMonitor(const Setup& setup, long num_steps)
    : num_steps_(num_steps),
      time_step_(setup.scenario().plant.time_step),
      of_joints_(setup.joints() != nullptr),
      has_heading_(setup.model().num_base_positions() == 3),
      fingertip_slips_(setup.fingertips().size(), Vector3d::Zero()),
      wheel_slips_(setup.adapter().wheels().size(), Vector3d::Zero()),
      cone_margin_(std::numeric_limits<double>::infinity()) {
  const Vector6d& start = setup.scenario().start_error();
  by_position_ = start.head<3>().norm() > 0.0 || start.tail<3>().norm() == 0.0;
  start_error_ = by_position_ ? start.head<3>().norm() : start.tail<3>().norm();
  if (by_position_ && start_error_ > 0.0) direction_ = start.head<3>() / start_error_;
  for (const EngineWheel& wheel : setup.adapter().wheels()) motor_dofs_.push_back(wheel.dof);
  for (const int dof : setup.adapter().joint_dofs()) motor_dofs_.push_back(dof);
}

void TrialMonitor::Record(const StepRecord& step) {
  // A step that ended before the plant responded has no slip of its own.
  const bool is_complete = step.step > steps_;
  steps_ = step.step;
  RecordError(step);
  if (is_complete) RecordSlip(step);
  RecordMotors(step);
}

void TrialMonitor::RecordError(const StepRecord& step) {
  const TrackingError& error = step.error;
  error_ = of_joints_ ? error.joints : error.position.norm();
  const double size = by_position_ ? error_ : error.orientation;
  const bool inside = size <= kSettledFraction * start_error_;
  if (inside && !settled_) settled_since_ = step.time;
  settled_ = inside;
  if (start_error_ > 0.0) {
    overshoot_ = std::max(overshoot_, -error.position.dot(direction_) / start_error_);
  }
  const long quarter = 4 * (step.step - 1) / std::max(num_steps_, 1L);
  if (quarter != 0 && quarter != 3) return;
  const size_t which = quarter == 0 ? 0 : 1;
  quarter_squares_[which] += size * size;
  ++quarter_steps_[which];
}

void TrialMonitor::RecordSlip(const StepRecord& step) {
  const auto slide = [&](const BodyContact& contact, const Matrix3d& R, Vector3d* distance, double* largest) {
    if (contact.touching) *distance += time_step_ * (R.transpose() * contact.slip);
    *largest = std::max(*largest, distance->norm());
  };
  const MeasuredState& state = step.reading.state;
  for (size_t i = 0; i < fingertip_slips_.size(); ++i) {
    const BodyContact& contact = step.response.fingertips[i];
    if (contact.touching) cone_margin_ = std::min(cone_margin_, contact.cone_margin);
    slide(contact, state.X_Bo.linear(), &fingertip_slips_[i], &fingertip_slip_);
  }
  const double phi = has_heading_ ? state.q[2] : 0.0;
  const Matrix3d R_B0 = Eigen::AngleAxisd(phi, Vector3d::UnitZ()).toRotationMatrix();
  for (size_t i = 0; i < wheel_slips_.size(); ++i) {
    slide(step.response.wheels[i], R_B0, &wheel_slips_[i], &wheel_slip_);
  }
}

void TrialMonitor::RecordMotors(const StepRecord& step) {
  const VectorXd& tau = step.command.tau;
  double power = 0.0;
  for (size_t i = 0; i < motor_dofs_.size(); ++i) {
    power += std::abs(tau[static_cast<Eigen::Index>(i)] * step.reading.qvel[motor_dofs_[i]]);
  }
  energy_ += power * time_step_;
  peak_torque_ = std::max(peak_torque_, tau.cwiseAbs().maxCoeff());
  peak_effort_ = std::max(peak_effort_, step.drive.effort);
}

std::array<double, kNumMetrics> TrialMonitor::CalcMetrics(const TrackingStatistics& tracking) const {
  std::array<double, kNumMetrics> metrics;
  metrics.fill(kNone);
  metrics[kSimulatedTime] = static_cast<double>(steps_) * time_step_;
  if (steps_ == 0) return metrics;
  if (of_joints_) {
    metrics[kJointErrorRms] = tracking.joints_rms();
    metrics[kJointErrorMax] = tracking.joints_max();
  } else {
    metrics[kPositionErrorRms] = tracking.position_rms();
    metrics[kPositionErrorMax] = tracking.position_max();
    metrics[kOrientationErrorRms] = tracking.orientation_rms();
    metrics[kOrientationErrorMax] = tracking.orientation_max();
  }
  if (start_error_ > 0.0 && settled_) metrics[kSettlingTime] = settled_since_;
  if (start_error_ > 0.0 && by_position_) metrics[kOvershoot] = overshoot_;
  if (quarter_steps_[1] > 0 && quarter_squares_[0] > 0.0) {
    metrics[kErrorGrowth] = std::sqrt(quarter_squares_[1] / static_cast<double>(quarter_steps_[1]) /
                                      (quarter_squares_[0] / static_cast<double>(quarter_steps_[0])));
  }
  metrics[kPeakTorque] = peak_torque_;
  metrics[kPeakEffort] = peak_effort_;
  metrics[kEnergy] = energy_;
  if (std::isfinite(cone_margin_)) metrics[kConeMargin] = cone_margin_;
  metrics[kFingertipSlip] = fingertip_slip_;
  metrics[kWheelSlip] = wheel_slip_;
  return metrics;
}

}  // namespace dexcheck
