#pragma once

// Stability margins of a motion of joints, and gains that follow from them.

#include <optional>
#include <string>

#include "controller/control/joint_controller.h"
#include "harness/run/runner.h"
#include "harness/run/sampled_loop.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// Returns the loop at rest in a posture: the law with these gains, of the controller's model, linearised by
/// central differences; the plant's own mass matrix, viscous damping and gravity; sampling, delays, lags and
/// filters of the scenario. Nonlinear parts (encoder counts, dry friction, limits) are left out. None where
/// rates come from a Kalman filter, or the state has more than 300 numbers.
std::optional<LinearLoop> LineariseJoints(const Setup& setup, const JointGains& gains,
                                          const Eigen::Ref<const VectorXd>& q);

/// Returns the margins of the setup's motion with these gains; none as LineariseJoints, or without such a
/// motion.
/// @param together as CalcMargins.
std::optional<JointMargins> CalcJointMargins(const Setup& setup, const JointGains& gains,
                                             bool together = true);

/// Multiplies the natural frequencies by a factor: K_p and K by its square.
JointGains ScaleGains(JointGains gains, double factor);

/// The largest factor of the natural frequencies that leaves enough of each margin.
struct BestGains {
  static constexpr double kGain = 2.0;              ///< Gain margin that suffices, 6 dB.
  static constexpr double kPhase = DegToRad(45.0);  ///< Phase margin that suffices, rad.
  double factor = 0.0;                              ///< 0 where none is found within a factor of 1000.
  std::string limited_by;                           ///< "phase margin of joint4".
};
BestGains FindBestGains(const Setup& setup);

/// Writes the scenario's [control], natural frequencies times a factor, as TOML.
std::string WriteJointControl(const Scenario& scenario, double factor);

/// Writes each line as a comment of TOML.
std::string CommentLines(const std::string& text);

/// Fills margins and gain card for a motion of joints whose law is known. The card is TOML that may replace
/// the scenario's [control]: the best gains, with comments that state the scenario's gains, the errors, the
/// margins and the limiting one.
void JudgeGains(const Setup& setup, const ClosedLoop& loop, RunResult* result);

}  // namespace dexcheck
