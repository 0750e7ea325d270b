#pragma once

// Passes over an MJCF, each of which changes it, notes what it did (MjcfFile::changes), or refuses it.

#include <mujoco/mujoco.h>

#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "harness/engine/engine.h"
#include "harness/engine/mjcf_file.h"

namespace dexcheck {

/// Loads an MJCF for drawing only. A model whose moving parts can be seen stays as it is. Where all shapes
/// that move are in groups that the engine hides, they are shown. A robot with shapes on less than half of
/// its links, as in descriptions made for dynamics, gets rods from each body to the bodies that hang on it,
/// to its sites, and to the centre of mass of the last ones, and balls at its joints. A model without lights
/// gets a brighter headlight. Bodies, joints and sites keep their numbers.
/// @param mjcf gets the rods and balls. @throws InputError as LoadMjcf.
MjModelPtr LoadVisible(MjcfFile* mjcf);

/// Makes an MJCF readable for this program's engine: CheckNumbers, LeaveOutNewerWords, LeaveOutAssets.
void AdaptMjcf(MjcfFile* mjcf);

/// Suppresses the messages of later loads of this file: the run whose log it comes from has printed them.
void KeepQuietAbout(const std::filesystem::path& mjcf);

/// Checks single integers and lists of numbers, of which the engine reads what it can and drops the rest: 1
/// of "1,5". Removes blanks at which it reads a number twice.
/// @throws InputError "FILE:LINE: <size nconmax>: must be an integer, got "1,5"".
void CheckNumbers(MjcfFile* mjcf);

/// Leaves out words that this program's engine does not know and that have no effect on the dynamics.
/// @throws InputError "FILE:LINE: <joint damping>: ...", with the release and the remedy, for words that act
/// on the dynamics or are unknown.
void LeaveOutNewerWords(MjcfFile* mjcf);

/// Leaves out the elements that depend on missing or broken files (meshes, height fields, skins, textures)
/// and on missing materials: visual parts, and the contacts of geoms without a mesh.
/// @throws InputError "FILE:LINE: mesh "no.stl": does not exist; ..." where a body's mass follows from the
/// mesh.
void LeaveOutAssets(MjcfFile* mjcf);

/// States a default of later releases that 2.2.2 lacks: a range alone limits (autolimits).
void StateNewDefaults(MjcfFile* mjcf);

/// Replaces all of an MJCF's actuators by one torque motor for each joint of the robot, as a run needs them:
/// the run's controller takes the place of servos, muscles and tendons. A motor's limit is the largest force
/// that the joint's actuator could deliver; sensors of actuators and the controls of key frames are removed
/// as well.
/// @param limits of joints whose actuators state none, N m or N, by name.
/// @throws InputError when the engine cannot load it, or a joint has no name.
void AddMotors(MjcfFile* mjcf, const std::map<std::string, double>& limits = {});

/// Leaves out the effects on joints, other than a run's motors, that a run's model does not have:
/// constraints, tendons, joint springs, limits that push before a joint's end (margin), and gravity
/// compensation (gravcomp). Ball joints are held.
void KeepMechanism(MjcfFile* mjcf);

/// Leaves out the moving bodies that are no part of the robot, with the elements that refer to them, and the
/// effects on a floating base as a joint: a joint of type "free" takes a class's attributes for joints.
/// @param engine as loaded from this MJCF. @throws InputError when two robots have as many joints.
void LeaveOutOthers(const mjModel& engine, MjcfFile* mjcf);

/// Welds floating bodies to the world, higher by `lift`, m: removes free joints and key frames.
void HoldBase(double lift, MjcfFile* mjcf);

/// States a solver that iterates until rounding, since a run's checks see the error of an early end.
void RequireExactSolver(MjcfFile* mjcf);

/// Lists the elements of an MJCF's bodies by the engine's numbers; the first is null. Where elements make
/// bodies of their own there are fewer.
std::vector<tinyxml2::XMLElement*> ListBodies(const MjcfFile& mjcf);

/// Names joints and bodies that have no name by the engine's numbers: "#1".
void NameParts(MjcfFile* mjcf);

/// Excludes the contact of a link with the fixed link that it turns on: the engine excludes neighbours, but
/// not those of bodies that are welded to the world.
/// @returns "base_link and link_1" of each that it adds. @throws as AddMotors.
std::vector<std::string> ExcludeBaseContacts(MjcfFile* mjcf);

/// Excludes the contacts of the robot's bodies that overlap in any of these poses by the shapes of the engine
/// or of a run's clearance: meshes and their hulls often do.
/// @param poses rad or m, by joint. @param with_world also excludes bodies that overlap the world in the
/// first pose, which no motion avoids. @returns "link_1 and link_3" of each. @throws as AddMotors.
std::vector<std::string> ExcludeOverlaps(const std::vector<std::map<std::string, double>>& poses,
                                         bool with_world, MjcfFile* mjcf);

/// Returns a copy of a compiled model in which these geoms touch as well, as if the MJCF had a `pair` of
/// three dimensions for each: sliding friction is the larger one of the two geoms', as the engine mixes it,
/// and stiffness the default's.
/// @param model of the MJCF; its numbers may have been changed since.
/// @throws InputError when the model lets geoms touch by contype and conaffinity, whose order counts.
MjModelPtr AddContactPairs(const mjModel& model, std::span<const std::pair<int, int>> geoms,
                           const std::filesystem::path& mjcf);

/// Returns the least and the largest force of an actuator at its joint, N m or N: by its forcerange and, for
/// a plain motor, by its ctrlrange, times its gear; none when neither limits it.
std::optional<std::pair<double, double>> FindForceLimits(const mjModel& m, int actuator);

/// Returns the largest force that joints themselves allow (actuatorfrcrange, which this program's engine does
/// not know and AdaptMjcf removes), by name: their own, or their class's.
std::map<std::string, double> FindForceRanges(const MjcfFile& mjcf);

/// Lists what words of later releases, which AdaptMjcf removes, say of the forces of actuators, their own or
/// their class's: "joint elbow: kv 25".
std::vector<std::string> ListNewerForces(const MjcfFile& mjcf);

/// Returns the root's last element of that name, which outweighs others; a new one when it has none.
tinyxml2::XMLElement* RequireSection(tinyxml2::XMLElement* root, const char* name);

/// Removes the controls of key frames, whose actuators are gone.
void DeleteControls(tinyxml2::XMLElement* root);

/// An element whose attribute names a file: a mesh, height field, skin or texture.
struct AssetFile {
  tinyxml2::XMLElement* element;
  const char* attribute;
  std::filesystem::path folder;  ///< Folder that the compiler gives for its kind, from the MJCF's folder.
  std::filesystem::path path;    ///< From the MJCF's folder.
};
std::vector<AssetFile> ListAssetFiles(tinyxml2::XMLElement* root);

/// Returns why the engine cannot read a mesh's file (STL, OBJ or MSH): "does not exist", "face 12 has vertex
/// 900 of 60"; empty when it can. The engine's own readers follow indices without checking them.
std::string FindMeshFault(const std::filesystem::path& file);

}  // namespace dexcheck
