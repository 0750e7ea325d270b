#pragma once

// The tree of an engine's model that is the robot: scenes have objects as well, and published robots parts
// that are parked in the world.

#include <mujoco/mujoco.h>

#include <limits>
#include <string>
#include <vector>

#include "harness/engine/adapter.h"

namespace dexcheck {

/// The carrier of a model's robot.
struct RobotTree {
  /// The body that a free joint moves and that carries the robot's joints; 0 when its base is fixed.
  int floating_body = 0;
  /// Names of the bodies that carry everything else.
  std::vector<std::string> others;
};

/// Finds the robot. All bodies on the world are one robot with a fixed base; a body with a free joint and all
/// that it carries is one that floats. The robot is the one with the most joints, free ones not counted; a
/// single floating body is the robot when nothing else moves.
/// @throws InputError with `source` when two have as many.
RobotTree FindRobotTree(const mjModel& engine, const std::string& source);

/// Returns the floating body that carries a joint; 0 when the world does.
int FindTree(const mjModel& engine, int joint);

/// Finds the sphere of a fingertip: the nearest to the site among the spheres on its body that can touch, or
/// among all there when none can; -1 without one, or when its centre is farther away than `within`, m.
int FindTipSphere(const mjModel& engine, int site, double within = std::numeric_limits<double>::infinity());

/// Calculates the moment of inertia of a wheel's body about its hinge, kg m^2.
double CalcSpinInertia(const mjModel& engine, const EngineWheel& wheel);

}  // namespace dexcheck
