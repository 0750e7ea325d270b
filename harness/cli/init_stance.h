#pragma once

// The feet that a robot with a floating base stands on, and the scenario in which it does.

#include <map>
#include <string>
#include <vector>

#include "controller/control/joint_motion.h"
#include "harness/descriptions/robot_description.h"
#include "harness/engine/engine.h"
#include "harness/engine/mjcf_file.h"

namespace dexcheck::cli {

constexpr double kAddedRadius = 0.005;  ///< m, of spheres that are added to feet.

/// A place of the robot that stands on the ground: a sphere's centre, the end of a capsule, the corner of a
/// box; of a mesh or a cylinder, the centre of a small sphere that is added there.
struct Foot {
  std::string frame;    ///< Name of the site that is added there.
  int geom = -1;        ///< Of the engine's model.
  Vector3d p_body;      ///< In the body's frame, m.
  double radius = 0.0;  ///< m; 0 for a corner.
  bool is_added = false;
};

/// How the robot stands, in the posture of its first key frame, or at zero, or as near to it as it can.
struct Stand {
  std::vector<Foot> feet;
  bool has_wheels = false;             ///< A foot turns without end about its own axis.
  double height = 0.0;                 ///< Of the base above the lowest foot, m.
  double weight = 0.0;                 ///< N.
  double sway = 1.0;                   ///< How far it moves: of what a robot on four feet can, 0 to 1.
  bool in_plane = false;               ///< It moves along x and z, and turns about y, alone.
  std::map<std::string, double> pose;  ///< Of joints, rad or m.
  std::vector<std::map<std::string, double>> poses;  ///< Likewise, as it sways.
  std::vector<std::string> weak;                     ///< Joints whose motors' limits are too low for that.
};

/// Joints of a robot, whose base is not said to be fixed, at the ends of its legs: chains of as many joints
/// that reach lowest while all joints are zero, lower than the base. None where there are not two.
std::vector<int> FindLegs(const RobotDescription& robot);

/// Adds the shapes of the legs' last links to an MJCF that has none (WriteMjcf): spheres, or boxes around
/// others, or, of meshes, a small sphere at what is welded farthest.
void AddLegShapes(const RobotDescription& robot, const std::vector<int>& legs, MjcfFile* mjcf);

/// Places that are lowest, of each body four at the most, as the first key frame or zero puts its joints.
Stand FindStand(const mjModel& m, bool at_key);

/// Adds a site of each foot, a floor where there is none, and pairs of each foot with it, which alone touch.
/// @throws InputError when the body of a foot has no name.
void PutOnFloor(const mjModel& m, const Stand& stand, MjcfFile* mjcf);

/// Least normal force that the scenario's law asks of a foot, N.
double LeastForce(const Stand& stand);

/// How the base sways: down by 3 % of its height, turned by 2 degrees, and swinging by a third of that.
struct Sway {
  std::vector<JointWayPoint> points;
  std::vector<JointOscillation> swings;  ///< By axis.
};
Sway ListWay(const Stand& stand);

/// Finds a posture from which the robot can sway with forces of the ground inside their cones: that of the
/// stand, or with joints bent and the centre of mass over the feet.
/// @param limits of motors by joint, N m or N. @returns why there is none; empty when there is one.
std::string FindPosture(const RobotModel& model, const std::map<std::string, double>& limits, Stand* stand);

/// Gives the frames of feet their spheres' radius.
void AddFeet(const Stand& stand, RobotDescription* robot);

/// The scenario in which it sways over its feet. @param tolerance of runs; 0 for rounding.
std::string WriteStandScenario(const RobotDescription& robot, const Stand& stand, double tolerance);

}  // namespace dexcheck::cli
