#include "harness/study/trial_monitor.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/plant/body_contact.h"

namespace dexcheck {
namespace {

constexpr double kSettledShare = 0.02;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr int kWorldBody = 0;

}  // namespace

TrialMonitor::TrialMonitor(const Setup& setup, const ClosedLoop& loop)
    : setup_(&setup), loop_(&loop), cone_margin_(std::numeric_limits<double>::infinity()) {
  const Vector6d& start = setup.scenario().start_error;
  by_position_ = start.head<3>().norm() > 0.0 || start.tail<3>().norm() == 0.0;
  start_error_ = by_position_ ? start.head<3>().norm() : start.tail<3>().norm();
  if (by_position_ && start_error_ > 0.0) direction_ = start.head<3>() / start_error_;
  const mjModel& engine = setup.engine();
  for (const int tip : setup.fingertips()) {
    fingertips_.push_back(
        {engine.site_bodyid[setup.adapter().frame_sites()[static_cast<size_t>(tip)]], Vector3d::Zero()});
  }
  for (const EngineWheel& wheel : setup.adapter().wheels()) {
    wheels_.push_back({engine.jnt_bodyid[wheel.joint], Vector3d::Zero()});
    motor_dofs_.push_back(wheel.dof);
  }
  for (const int dof : setup.adapter().joint_dofs()) motor_dofs_.push_back(dof);
}

void TrialMonitor::Record() {
  RecordError();
  RecordSlip();
  RecordMotors();
}

void TrialMonitor::RecordError() {
  const TrackingError& error = loop_->error();
  const double size = by_position_ ? error.position.norm() : error.orientation;
  const bool inside = size <= kSettledShare * start_error_;
  if (inside && !settled_) settled_since_ = loop_->step_time();
  settled_ = inside;
  if (start_error_ > 0.0) {
    overshoot_ = std::max(overshoot_, -error.position.dot(direction_) / start_error_);
  }
  // step() is already that of the next one.
  const long quarter = 4 * (loop_->step() - 1) / std::max(loop_->num_steps(), 1L);
  if (quarter != 0 && quarter != 3) return;
  const size_t which = quarter == 0 ? 0 : 1;
  quarter_squares_[which] += size * size;
  ++quarter_steps_[which];
}

double TrialMonitor::Slide(Slip* slip, int other, const Matrix3d& R) {
  const Plant& plant = loop_->plant();
  const BodyContact contact = ReadBodyContact(plant.model(), plant.data(), slip->body, other);
  if (!contact.touching) return std::numeric_limits<double>::infinity();
  slip->distance += plant.time_step() * (R.transpose() * contact.slip);
  return contact.cone_margin;
}

void TrialMonitor::RecordSlip() {
  const MeasuredState& state = loop_->state();
  for (Slip& slip : fingertips_) {
    const double margin = Slide(&slip, setup_->adapter().object_body(), state.X_Bo.linear());
    cone_margin_ = std::min(cone_margin_, margin);
    fingertip_slip_ = std::max(fingertip_slip_, slip.distance.norm());
  }
  const double phi = setup_->model().num_base_positions() == 3 ? state.q[2] : 0.0;
  const Matrix3d R_B0 = Eigen::AngleAxisd(phi, Vector3d::UnitZ()).toRotationMatrix();
  for (Slip& slip : wheels_) {
    Slide(&slip, kWorldBody, R_B0);
    wheel_slip_ = std::max(wheel_slip_, slip.distance.norm());
  }
}

void TrialMonitor::RecordMotors() {
  const VectorXd& tau = loop_->tau();
  double power = 0.0;
  for (size_t i = 0; i < motor_dofs_.size(); ++i) {
    power += std::abs(tau[static_cast<Eigen::Index>(i)] * loop_->qvel()[motor_dofs_[i]]);
  }
  energy_ += power * loop_->plant().time_step();
  peak_torque_ = std::max(peak_torque_, tau.cwiseAbs().maxCoeff());
  peak_effort_ = std::max(peak_effort_, loop_->effort());
}

std::array<double, kNumMetrics> TrialMonitor::CalcMetrics(const TrackingStatistics& tracking) const {
  std::array<double, kNumMetrics> metrics;
  metrics.fill(kNone);
  metrics[kSimulatedTime] = loop_->time();
  if (loop_->step() == 0) return metrics;
  metrics[kPositionErrorRms] = tracking.position_rms();
  metrics[kPositionErrorMax] = tracking.position_max();
  metrics[kOrientationErrorRms] = tracking.orientation_rms();
  metrics[kOrientationErrorMax] = tracking.orientation_max();
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
