#include "harness/sides/read_description.h"

#include "controller/model/parameter_reader.h"
#include "harness/engine/engine.h"
#include "harness/sides/mjcf_reader.h"
#include "harness/sides/robot_file.h"

namespace dexcheck {
namespace {

RobotDescription ReadTable(const std::filesystem::path& path) {
  RobotDescription robot;
  robot.spec = ReadRobotModel(path).spec();
  robot.joints.resize(robot.spec.joints.size());
  for (DescribedJoint& joint : robot.joints) joint.states_dry_friction = false;  // tables have no key for it
  return robot;
}

}  // namespace

RobotDescription ReadDescription(const std::filesystem::path& path, const UrdfOptions& options) {
  switch (FindFormat(path)) {
    case RobotFormat::kUrdf:
      return ReadUrdf(path, options);
    case RobotFormat::kMjcf:
      return ReadMjcfDescription(*LoadMjcf(path), path.string());
    case RobotFormat::kToml:
      break;
  }
  return ReadTable(path);
}

}  // namespace dexcheck
