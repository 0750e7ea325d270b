#pragma once

// What can be compared without motion, before anything else: masses, joints, wheels, fingertips, object,
// options.

#include <string>
#include <vector>

#include "harness/base/check_record.h"
#include "harness/engine/adapter.h"

namespace dexcheck {

/// One constant that the parameter file and the MJCF give differently.
struct GateFinding {
  std::string check;  ///< Name of the check, such as "link_mass".
  std::string where;  ///< Part of the robot, such as "link r_forearm".
  double model = 0.0;
  double engine = 0.0;
  Location location;
  int entry =
      0;  ///< Which of the numbers that the check compares there: of a vector, of a range, of a 3x3 tensor.
};

struct GateResult {
  std::vector<CheckRecord> records;
  std::vector<GateFinding> findings;  ///< Every disagreement, in the file's order.
};

/// Compares constants: mass of each link; damping, armature and range of each joint; gravity; the wheels'
/// radius, place, axis, mass, inertia, damping and armature; fingertip radii; the object's mass, inertia,
/// centre of mass and friction; and that the MJCF has no forces which the analytic model lacks (springs,
/// fluid); dry friction.
GateResult RunStaticGate(const Adapter& adapter);

}  // namespace dexcheck
