#pragma once

// Passes over an MJCF, each of which changes it, notes what it did (MjcfFile::changes), or refuses it.

#include <mujoco/mujoco.h>

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "harness/engine/mjcf_file.h"

namespace dexcheck {

/// Makes an MJCF one that this program's engine reads: CheckNumbers, LeaveOutNewerWords, LeaveOutAssets.
void AdaptMjcf(MjcfFile* mjcf);

/// What later loads of this file leave out of it is not said: the run whose log it comes from has said it.
void KeepQuietAbout(const std::filesystem::path& mjcf);

/// Of single integers and of lists of numbers the engine reads what it can and drops the rest: 1 of "1,5".
/// Takes off blanks at which it reads a number twice.
/// @throws InputError "FILE:LINE: <size nconmax>: must be an integer, got "1,5"".
void CheckNumbers(MjcfFile* mjcf);

/// Leaves out what this program's engine does not know and what has no effect on the dynamics.
/// @throws InputError "FILE:LINE: <joint damping>: ...", which says since which release and what to do, for
/// what acts on the dynamics or is not known at all.
void LeaveOutNewerWords(MjcfFile* mjcf);

/// Leaves out what its missing or broken files (meshes, height fields, skins, textures) and missing materials
/// take with them: looks, and the contacts of geoms that have no mesh.
/// @throws InputError "FILE:LINE: mesh "no.stl": does not exist; ..." where a body's mass follows from the
/// mesh.
void LeaveOutAssets(MjcfFile* mjcf);

/// States what later releases take by default, and 2.2.2 refuses to guess: a range alone limits (autolimits).
void StateNewDefaults(MjcfFile* mjcf);

/// Puts one torque motor for each joint of the robot in the place of all of an MJCF's actuators, as a run
/// needs them: servos, muscles and tendons are what a controller here replaces. A motor's limit is what the
/// joint's actuator could deliver; sensors of actuators and the controls of key frames go with them.
/// @param limits of joints whose actuators state none, N m or N, by name.
/// @throws InputError when the engine cannot load it, or a joint has no name.
void AddMotors(MjcfFile* mjcf, const std::map<std::string, double>& limits = {});

/// Leaves out what acts on joints beside a run's motors, and a run's model has not: constraints, tendons,
/// springs of joints, what pushes before their ends (margin), and the weight that bodies do not feel
/// (gravcomp). Ball joints are held.
void KeepMechanism(MjcfFile* mjcf);

/// Leaves out what moves and is no part of the robot, with what names it, and what acts on a floating base as
/// on a joint: `<joint type="free">` takes what a class has for joints.
/// @param engine as it was loaded of this MJCF. @throws InputError when two robots have as many joints.
void LeaveOutOthers(const mjModel& engine, MjcfFile* mjcf);

/// Welds what floats to the world, higher by `lift`, m: free joints go, and key frames with them.
void HoldBase(double lift, MjcfFile* mjcf);

/// States a solver that goes on until rounding: a run's checks see what an early end leaves.
void RequireExactSolver(MjcfFile* mjcf);

/// Names joints and bodies that have no name as the engine numbers them: "#1".
void NameParts(MjcfFile* mjcf);

/// Excludes the contact of a link with the fixed link that it turns on: the engine leaves out neighbours, but
/// not those of what is welded to the world.
/// @returns "base_link and link_1" of each that it adds. @throws as AddMotors.
std::vector<std::string> ExcludeBaseContacts(MjcfFile* mjcf);

/// Excludes the contacts of the robot's bodies that lie in each other in any of these poses, as the engine or
/// a run's clearance has their shapes: meshes and their hulls often do.
/// @param poses rad or m, by joint. @param with_world excludes what overlaps the world in the first pose,
/// too, since no motion avoids it. @returns "link_1 and link_3" of each. @throws as AddMotors.
std::vector<std::string> ExcludeOverlaps(const std::vector<std::map<std::string, double>>& poses,
                                         bool with_world, MjcfFile* mjcf);

/// The least and the largest force of an actuator at its joint, N m or N: by its forcerange and, of a plain
/// motor, by its ctrlrange, times its gear; none when neither limits it.
std::optional<std::pair<double, double>> FindForceLimits(const mjModel& m, int actuator);

/// The largest force that joints themselves allow (actuatorfrcrange, which this program's engine does not
/// know and AdaptMjcf takes away), by name: their own, or their class's.
std::map<std::string, double> FindForceRanges(const MjcfFile& mjcf);

/// The element of that name of an MJCF's root, the last, which outweighs others; a new one when it has none.
tinyxml2::XMLElement* RequireSection(tinyxml2::XMLElement* root, const char* name);

/// Takes away controls of key frames, whose actuators are gone.
void DeleteControls(tinyxml2::XMLElement* root);

/// A file that a mesh, height field, skin or texture names.
struct AssetFile {
  tinyxml2::XMLElement* element;
  const char* attribute;
  std::filesystem::path folder;  ///< That the compiler gives for its kind, from the MJCF's folder.
  std::filesystem::path path;    ///< From the MJCF's folder.
};
std::vector<AssetFile> ListAssetFiles(tinyxml2::XMLElement* root);

/// What the engine cannot read of a mesh's file (STL, OBJ or MSH): "does not exist", "face 12 has vertex 900
/// of 60". Empty when it can. The engine's own readers follow indices without looking at them.
std::string FindMeshFault(const std::filesystem::path& file);

}  // namespace dexcheck
