#pragma once

// Sources of the folder that `init` makes: a robot's files, read and adapted so that a run can drive it.

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "harness/descriptions/robot_description.h"
#include "harness/engine/engine.h"
#include "harness/engine/mjcf_file.h"

namespace dexcheck::cli {

struct InitRequest {
  std::filesystem::path robot;
  std::filesystem::path mjcf;
  std::string from;
  std::string out;
};

/// Robot and MJCF of what was given; the MJCF is made of the description where there is none.
struct InitSources {
  RobotDescription robot;
  std::unique_ptr<MjcfFile> mjcf;
  std::map<std::string, double> rates;  ///< Largest that the URDF states, rad/s or m/s.
};

InitSources ReadSources(const InitRequest& request);

/// Compiles an MJCF as it stands now.
MjModelPtr Load(const MjcfFile& mjcf);

/// Excludes contacts of links with the fixed links that they turn on, and warns of it.
void LeaveOutBaseContacts(MjcfFile* mjcf);

/// Writes the friction of joints into their elements, whatever their classes have.
void StateFriction(const std::vector<Joint>& joints, MjcfFile* mjcf);

/// Copies meshes, textures and the like into the folder's assets: a log keeps what lies beside the MJCF.
void TakeAssets(const std::filesystem::path& folder, MjcfFile* mjcf);

/// The sky of this program's own scenes, where the file has none: pictures have a black one otherwise.
void AddSky(MjcfFile* mjcf);

/// Limits of motors by joint, N m or N.
std::map<std::string, double> ReadMotorLimits(const mjModel& m);

/// Returns the joints' positions in the first key frame, rad or m; none without one.
std::map<std::string, double> ReadHome(const mjModel& m);

/// Takes away the limits of motors that cannot carry the robot.
void FreeMotors(const std::vector<std::string>& names, MjcfFile* mjcf);

}  // namespace dexcheck::cli
