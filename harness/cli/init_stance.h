#pragma once

// The feet that a robot with a floating base stands on, and the scenario in which it does.

#include <map>
#include <string>
#include <vector>

#include "harness/descriptions/robot_description.h"
#include "harness/engine/engine.h"
#include "harness/engine/mjcf_file.h"

namespace dexcheck::cli {

/// A place of the robot that stands on the ground: a sphere's centre, the end of a capsule, the corner of a
/// box.
struct Foot {
  std::string frame;    ///< Name of the site that is added there.
  int geom = -1;        ///< Of the engine's model.
  Vector3d p_body;      ///< In the body's frame, m.
  double radius = 0.0;  ///< m; 0 for a corner.
};

/// Where the robot stands when it is as its first key frame says, or at zero.
struct Stand {
  std::vector<Foot> feet;
  double height = 0.0;                 ///< Of the base above the lowest foot, m.
  double weight = 0.0;                 ///< N.
  std::map<std::string, double> pose;  ///< Of joints, rad or m.
};

/// Spheres, capsules' ends and boxes' corners that are lowest.
/// @throws InputError when fewer than three of them are.
Stand FindStand(const mjModel& m, const std::string& source);

/// Adds a site of each foot, a floor where there is none, and pairs of each foot with it, which alone touch.
void PutOnFloor(const mjModel& m, const Stand& stand, MjcfFile* mjcf);

/// Gives the frames of feet their spheres' radius.
void AddFeet(const Stand& stand, RobotDescription* robot);

/// The scenario in which it sways over its feet. @param tolerance of runs; 0 for rounding.
std::string WriteStandScenario(const RobotDescription& robot, const Stand& stand, double tolerance);

}  // namespace dexcheck::cli
