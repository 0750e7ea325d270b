#pragma once

// What one description does not state is taken from the other one, and is not compared.

#include <mujoco/mujoco.h>

#include <string>
#include <vector>

#include "harness/sides/robot_description.h"

namespace dexcheck {

/// What was taken over.
struct Completion {
  std::vector<std::string> notes;     ///< One line each, for the report: what is not compared, and why.
  std::vector<std::string> unstated;  ///< Names of the gate's checks of which the description states nothing.
};

/// Takes the engine's names of joints when they are alike, and completes a description by what an engine's
/// model states: gravity; range, damping, dry friction and armature of joints; the names of bodies, which
/// another format may choose differently (joints are what the two share). Frames without a site of their name
/// are dropped.
Completion CompleteFromEngine(const mjModel& engine, const std::string& engine_source,
                              RobotDescription* robot);

}  // namespace dexcheck
