#pragma once

// The feet that a robot with a floating base stands on, the posture in which it does, and the scenario in
// which it sways over them. What stands otherwise than on spheres, ends of capsules and corners of boxes, is
// not found.

#include <map>
#include <string>
#include <vector>

#include "controller/control/joint_motion.h"
#include "controller/model/robot_model.h"
#include "harness/descriptions/robot_description.h"
#include "harness/engine/engine.h"
#include "harness/engine/mjcf_file.h"
#include "harness/scenario/first_motion.h"

namespace dexcheck {

/// A place of the robot on the ground: the centre of a sphere, the end of a capsule, or the corner of a box.
struct Foot {
  std::string frame;    ///< Name of the site that is added there.
  int geom = -1;        ///< Of the engine's model.
  Vector3d p_body;      ///< In the body's frame, m.
  double radius = 0.0;  ///< m; 0 for a corner.
};

/// How the robot stands: as its first key frame has it, or with its joints at zero, or as near to it as it
/// can.
struct Stand {
  std::vector<Foot> feet;
  double height = 0.0;            ///< Height of the base above the lowest foot, m.
  double weight = 0.0;            ///< N.
  double sway = 1.0;              ///< Fraction of the largest motion, 0 to 1.
  JointPositions pose;            ///< The posture in which it stands.
  JointPoses poses;               ///< Postures as it sways.
  std::vector<std::string> weak;  ///< Joints whose motors' limits are too low for that.
};

/// Lowest places of the robot, at most four of each body, with its joints as the first key frame or zero has
/// them.
Stand FindStand(const mjModel& m, bool at_key);

/// Adds a site at each foot, a floor where there is none, and pairs of each foot with it, which alone touch.
/// @param mjcf of the model; its bodies have names.
void PutOnFloor(const mjModel& m, const Stand& stand, MjcfFile* mjcf);

/// Gives the frames of feet their spheres' radius.
void AddFeet(const Stand& stand, RobotDescription* robot);

/// Finds a posture from which the robot can sway with forces of the ground inside their cones: that of the
/// stand, or with joints bent and the centre of mass over the feet.
/// @param limits of motors by joint, N m or N. @returns why there is none; empty when there is one.
std::string FindPosture(const RobotModel& model, const std::map<std::string, double>& limits, Stand* stand);

/// The scenario in which it sways over its feet. @param tolerance of runs; 0 for rounding.
std::string WriteStandScenario(const RobotDescription& robot, const Stand& stand, double tolerance);

}  // namespace dexcheck
