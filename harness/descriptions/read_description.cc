#include "harness/descriptions/read_description.h"

#include "controller/common/errors.h"
#include "controller/model/body_frame.h"
#include "controller/model/parameter_reader.h"
#include "harness/base/files.h"
#include "harness/descriptions/mjcf_reader.h"
#include "harness/descriptions/parameter_writer.h"
#include "harness/descriptions/robot_file.h"
#include "harness/engine/engine.h"

namespace dexcheck {
namespace {

/// @param X_iL the link's own frame, in which its file gives the body.
void AddPart(const std::string& name, const MassProperties& body, int joint, const Pose& X_iL,
             RobotDescription* robot) {
  DescribedPart& part = robot->parts.emplace_back();
  part.name = name;
  part.body = X_iL.isApprox(Pose::Identity(), 0.0) ? body : ExpressIn(body, X_iL.inverse());
  part.joint = joint;
  part.X_iL = X_iL;
}

RobotDescription ReadTable(const std::string& text, const std::string& source) {
  RobotDescription robot;
  robot.is_imported = text.find(kImportMark) != std::string::npos;
  std::vector<WrittenRow> rows;
  robot.spec = ParseRobotModel(text, source, {}, &rows).spec();
  robot.joints.resize(robot.spec.joints.size());
  if (robot.spec.base.type != BaseType::kFixed)
    AddPart(robot.spec.base.link, robot.spec.base.body, -1, Pose::Identity(), &robot);
  for (size_t i = 0; i < robot.spec.joints.size(); ++i) {
    const Joint& joint = robot.spec.joints[i];
    static_cast<WrittenRow&>(robot.joints[i]) = rows[i];
    AddPart(joint.link, joint.body, static_cast<int>(i), rows[i].X_iL, &robot);
  }
  NoteImpossibleBodies(&robot);
  return robot;
}

}  // namespace

RobotDescription ReadDescription(const std::filesystem::path& path, const UrdfOptions& options) {
  const std::string text = ReadBytes(path);
  switch (FindFormat(text, path)) {
    case RobotFormat::kUrdf:
      return ParseUrdf(text, path.string(), options);
    case RobotFormat::kMjcf:
      return ReadMjcfDescription(*LoadMjcf(path), path.string());
    case RobotFormat::kToml:
      break;
  }
  return ReadTable(text, path.string());
}

}  // namespace dexcheck
