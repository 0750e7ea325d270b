#pragma once

// Which of an engine's model's trees is the robot: scenes have objects besides, and published robots parts
// that are parked in the world.

#include <mujoco/mujoco.h>

#include <limits>
#include <string>
#include <vector>

#include "harness/engine/adapter.h"

namespace dexcheck {

/// What carries the robot of a model.
struct RobotTree {
  /// The body that a free joint moves and that carries the robot's joints; 0 when its base is fixed.
  int floating_body = 0;
  /// Names of the bodies that carry what is no part of it.
  std::vector<std::string> others;
};

/// All bodies on the world are one robot with a fixed base; a body with a free joint and all that it carries
/// is one that floats. The robot has the most joints, free ones not counted; a single body that floats is one
/// when nothing else moves.
/// @throws InputError with `source` when two have as many.
RobotTree FindRobotTree(const mjModel& engine, const std::string& source);

/// The floating body that carries a joint; 0 when the world does.
int FindTree(const mjModel& engine, int joint);

/// The sphere of a fingertip: of those on a site's body that can touch the nearest to the site, or of all
/// there when none can; -1 without one, or when its centre is farther away than `within`, m.
int FindTipSphere(const mjModel& engine, int site, double within = std::numeric_limits<double>::infinity());

/// Moments of inertia of a wheel's body, kg m^2.
struct WheelInertia {
  double spin = 0.0;        ///< About its hinge.
  double transverse = 0.0;  ///< Mean of those square to it.
};

WheelInertia CalcWheelInertia(const mjModel& engine, const EngineWheel& wheel);

}  // namespace dexcheck
