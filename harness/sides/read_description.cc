#include "harness/sides/read_description.h"

#include "controller/model/parameter_reader.h"
#include "harness/engine/engine.h"
#include "harness/sides/mjcf_reader.h"
#include "harness/sides/robot_file.h"

namespace dexcheck {
namespace {

void AddPart(const std::string& name, const MassProperties& body, int joint, RobotDescription* robot) {
  DescribedPart& part = robot->parts.emplace_back();
  part.name = name;
  part.body = body;
  part.joint = joint;
}

RobotDescription ReadTable(const std::filesystem::path& path) {
  RobotDescription robot;
  robot.spec = ReadRobotModel(path).spec();
  robot.joints.resize(robot.spec.joints.size());
  if (robot.spec.base.type != BaseType::kFixed)
    AddPart(robot.spec.base.link, robot.spec.base.body, -1, &robot);
  for (size_t i = 0; i < robot.spec.joints.size(); ++i) {
    const Joint& joint = robot.spec.joints[i];
    if (joint.type == JointType::kBall && joint.ball_axis < 2) continue;  // its link is no part of the file
    AddPart(joint.link, joint.body, static_cast<int>(i), &robot);
  }
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
