#pragma once

// Metrics of a run while it runs, from the plant alone: no cross-check is needed.

#include <array>
#include <vector>

#include "harness/simulation/run_summary.h"
#include "harness/study/trial_result.h"

namespace dexcheck {

/// Fingertips or wheels that slide further than this have slipped, m; the bounds of the cross-check.
constexpr double kFingertipSlipBound = 2e-4;
constexpr double kWheelSlipBound = 1e-3;

/// Watches one run. Nothing allocates after construction.
class TrialMonitor {
 public:
  TrialMonitor(const Setup& setup, const ClosedLoop& loop);

  /// Takes in the loop's last step.
  void Record();

  /// All metrics of the steps so far, those of `tracking` included.
  [[nodiscard]] std::array<double, kNumMetrics> CalcMetrics(const TrackingStatistics& tracking) const;

 private:
  struct Slip {
    int body = -1;
    Vector3d distance = Vector3d::Zero();
  };
  double Slide(Slip* slip, int other, const Matrix3d& R);
  void RecordError();
  void RecordSlip();
  void RecordMotors();

  const Setup* setup_;
  const ClosedLoop* loop_;
  Vector3d direction_ = Vector3d::Zero();  // of the start error
  double start_error_ = 0.0;               // m, or rad when the object is only turned
  bool by_position_ = true;
  double settled_since_ = 0.0;  // s
  bool settled_ = false;
  double overshoot_ = 0.0;
  std::array<double, 2> quarter_squares_{};  // first and last quarter
  std::array<long, 2> quarter_steps_{};
  std::vector<Slip> fingertips_, wheels_;
  std::vector<int> motor_dofs_;  // by entry of tau'
  double fingertip_slip_ = 0.0, wheel_slip_ = 0.0, cone_margin_;
  double peak_torque_ = 0.0, peak_effort_ = 0.0, energy_ = 0.0;
};

}  // namespace dexcheck
