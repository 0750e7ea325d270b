#pragma once

// Stability margins of a motion of joints, and what they say of its gains.

#include <optional>
#include <string>
#include <vector>

#include "controller/control/joint_controller.h"
#include "harness/run/run_summary.h"
#include "harness/run/sampled_loop.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// The loop at rest in a posture: the law with these gains, of the controller's model, linearised by central
/// differences; the plant's own mass matrix, viscous damping and gravity; sampling, delays, lags and filters
/// as the scenario has them. What is not linear (encoder counts, dry friction, limits) is left out.
/// None where rates come from a Kalman filter, or more than 300 numbers make the state.
std::optional<LinearLoop> LineariseJoints(const Setup& setup, const JointGains& gains,
                                          const Eigen::Ref<const VectorXd>& q);

/// Of the setup's motion with these gains; none as LineariseJoints, or without a motion of joints.
/// @param together as CalcMargins.
std::optional<JointMargins> CalcJointMargins(const Setup& setup, const JointGains& gains,
                                             bool together = true);

/// The natural frequencies times a factor: K_p and K by its square.
JointGains ScaleGains(JointGains gains, double factor);

/// The largest factor of the natural frequencies that leaves enough of each margin.
struct BestGains {
  static constexpr double kGain = 2.0;              ///< That is enough, 6 dB.
  static constexpr double kPhase = DegToRad(45.0);  ///< Likewise, rad.
  double factor = 0.0;                              ///< 0 where none is found within a factor of 1000.
  std::string limited_by;                           ///< "phase margin of joint4".
};
BestGains FindBestGains(const Setup& setup);

/// The scenario's [control], natural frequencies times a factor, as TOML.
std::string WriteJointControl(const Scenario& scenario, double factor);

/// Each line as a comment of TOML.
std::string CommentLines(const std::string& text);

/// Fills margins and gain card of a motion of joints whose law is known: TOML that may take the place of the
/// scenario's [control], the best gains, with yours, the errors, the margins and what limits them as
/// comments.
void JudgeGains(const Setup& setup, const ClosedLoop& loop, RunResult* result);

}  // namespace dexcheck
