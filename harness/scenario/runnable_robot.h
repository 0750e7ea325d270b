#pragma once

// A robot's files, read and adapted so that a run can drive it.

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "harness/descriptions/robot_description.h"
#include "harness/engine/engine.h"
#include "harness/engine/mjcf_file.h"
#include "harness/scenario/first_motion.h"

namespace dexcheck {

/// Robot and MJCF of what was given; the MJCF is made of the description where there is none.
struct RunnableRobot {
  RobotDescription robot;
  std::unique_ptr<MjcfFile> mjcf;
  std::map<std::string, double> rates;  ///< Largest that the URDF states, rad/s or m/s.
};

/// Reads a URDF, an MJCF, or a URDF with an MJCF of the same robot. Frictions that stop a joint within less
/// than 10 ms, which leaves its law no time to act, are reduced to what does so in that time. What is changed
/// is warned of.
/// @param mjcf empty where `robot` is alone. @throws InputError for what no run can drive.
RunnableRobot ReadRunnableRobot(const std::filesystem::path& robot, const std::filesystem::path& mjcf);

/// Compiles an MJCF as it stands now.
MjModelPtr Load(const MjcfFile& mjcf);

/// Describes an MJCF as it stands now.
/// @param file whose folder its assets are found from.
RobotDescription Describe(const std::filesystem::path& file, const MjcfFile& mjcf);

/// Excludes contacts of links with the fixed links that they turn on, and warns of it.
void LeaveOutBaseContacts(MjcfFile* mjcf);

/// Copies meshes, textures and the like into the folder's assets: a log keeps what lies beside the MJCF.
void TakeAssets(const std::filesystem::path& folder, MjcfFile* mjcf);

/// Adds the sky of this program's own scenes, where the file has none: pictures have a black one otherwise.
void AddSky(MjcfFile* mjcf);

/// Limits of motors by joint, N m or N.
std::map<std::string, double> ReadMotorLimits(const mjModel& m);

/// Returns the joints' positions in the first key frame; none without one.
JointPositions ReadHome(const mjModel& m);

/// Takes away the limits of motors that cannot carry the robot, and warns of it.
void FreeMotors(const std::vector<std::string>& names, MjcfFile* mjcf);

/// Joints that follow others no longer do, since each has a motor of its own in a run; warns of it.
void FreeCoupledJoints(RobotDescription* robot);

}  // namespace dexcheck
